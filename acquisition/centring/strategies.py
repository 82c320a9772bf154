"""The centring strategies by name; a new one is a class with `learn` and `propose`, and one line here.

`MeasuredStrategy` measures its own Jacobian by small probing moves and corrects it after every step (Broyden). It needs
no trust in the fixture pose at all; costs four probing moves. Spots are first turned into the four coordinates of the
incoming beam in the fixture frame, because those follow the robot almost linearly where the spots do not.
Source of the update: C. G. Broyden, Math. Comp. 19 (1965) 577, "good" form.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import AssumedArm, FixtureOptics, spots_by_joints
from acquisition.centring.loop import Centring, Proposal, Strategy
from acquisition.centring.registered import FIRST_GAIN, FixedGuess, Registered
from acquisition.errors import AcquisitionError

Floats = NDArray[np.float64]

PROBE_SPOT_M = 1.5e-3  # a probe moves the spots by about this: 15 % of a 20 mm face, 5000 x the noise of a look
PROBE_LIMIT_RAD = 0.02
LEVER_M = 0.1  # turns beam angles into metres: about the distance between the two faces
UPDATE_FLOOR_RAD = 1e-4  # shorter steps show more of noise than about the Jacobian


class MeasuredStrategy:
    """Four probes along the directions that the guess thinks independent, then quasi-Newton steps."""

    name = "measured"

    def __init__(self, arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int) -> None:
        self._arm, self._optics, self._T, self._first = arm, optics, T_base_fixture, first
        self._base_q = np.empty(0)
        self._base_c = np.empty(0)
        self._directions = np.empty((0, 0))  # (joint, 4)
        self._columns: list[Floats] = []
        self._jacobian = np.empty((4, 0))  # beam coordinates by amounts along the directions
        self._centre_hit_m, self._centre_direction = optics.line(np.zeros(4), first)

    def learn(self, q_rad: Floats, spots_m: Floats) -> None:
        coordinates = self._beam_coordinates(spots_m)
        if self._base_q.size == 0:
            self._plan_probes(q_rad)
        elif len(self._columns) < 4:
            made = float(self._directions[:, len(self._columns)] @ (q_rad - self._base_q))  # the loop may shorten it
            self._columns.append((coordinates - self._base_c) / made)
            if len(self._columns) == 4:
                self._jacobian = np.stack(self._columns, axis=1)
            return  # a probe: the base stays
        else:
            amounts = self._directions.T @ (q_rad - self._base_q)
            if np.linalg.norm(amounts) > UPDATE_FLOOR_RAD:
                surprise = coordinates - self._base_c - self._jacobian @ amounts
                self._jacobian = self._jacobian + np.outer(surprise, amounts) / (amounts @ amounts)
        self._base_q, self._base_c = q_rad, coordinates

    def propose(self, target_m: Floats) -> Proposal:
        if len(self._columns) < 4:
            k = len(self._columns)
            probe_rad = min(PROBE_SPOT_M / self._gains[k], PROBE_LIMIT_RAD)
            return Proposal(probe_rad * self._directions[:, k], "probe", stay=True)
        wanted = self._beam_coordinates(target_m) - self._base_c
        amounts = np.asarray(np.linalg.lstsq(self._jacobian, wanted, rcond=None)[0], dtype=np.float64)
        return Proposal(self._directions @ amounts, "correct")

    def _plan_probes(self, q_rad: Floats) -> None:
        guess = spots_by_joints(self._arm, self._optics, self._T, q_rad, self._first)
        _, self._gains, rows = np.linalg.svd(guess, full_matrices=False)
        self._directions = rows.T

    def _beam_coordinates(self, spots_m: Floats) -> Floats:
        """Offset from, and angle to, the beam of both centres, (4,): m, and rad times LEVER_M."""
        hit_m, direction = self._optics.line(spots_m, self._first)
        along = self._centre_direction
        e1 = np.cross(along, [1.0, 0.0, 0.0])
        e1 /= np.linalg.norm(e1)
        e2 = np.cross(along, e1)
        reach = float((self._centre_hit_m - hit_m) @ along / (direction @ along))
        offset = hit_m + reach * direction - self._centre_hit_m
        slope = direction / (direction @ along)
        return np.array([offset @ e1, offset @ e2, LEVER_M * (slope @ e1), LEVER_M * (slope @ e2)])


KNOWN_GAIN = 1.0  # of the first step, after a lit pose: the fixture pose is known there, not guessed


class CentringBy(Enum):
    """By the word of the command line."""

    REGISTERED = "registered"  # law (8), the fixture pose corrected from every reading
    MEASURED = "measured"  # the Jacobian from four probing moves, the fixture pose not trusted at all
    LAW8 = "law8"  # the source's own law, with the fixture pose as it was guessed


@dataclass(frozen=True)
class CentringChoice:
    """How the beam is centred; `gain` is k of law (8), and without meaning for the other two."""

    by: CentringBy = CentringBy.REGISTERED
    gain: float = 0.5

    @classmethod
    def asked(cls, by: CentringBy, gain: float) -> "CentringChoice":
        """AcquisitionError for a gain that cannot be, or of a strategy that has none."""
        if not 0.0 < gain <= 1.0:
            raise AcquisitionError(f"--gain {gain:g}: the share of a correction, above 0 and up to 1")
        if gain != cls.gain and by is not CentringBy.LAW8:
            raise AcquisitionError(f"--gain {gain:g} with --centring {by.value}: only law8 has a gain")
        return cls(by, gain)

    def strategy(
        self, arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int, *, known: bool
    ) -> Strategy:
        """A strategy for one run; `known`: T_base_fixture is right where the arm stands, from an earlier lit pose."""
        make: Mapping[CentringBy, Callable[[], Strategy]] = {
            CentringBy.REGISTERED: lambda: Registered(
                arm, optics, T_base_fixture, first, KNOWN_GAIN if known else FIRST_GAIN
            ),
            CentringBy.MEASURED: lambda: MeasuredStrategy(arm, optics, T_base_fixture, first),
            CentringBy.LAW8: lambda: FixedGuess(arm, optics, T_base_fixture, first, self.gain),
        }
        return make[self.by]()


def fixture_after(
    run: Centring, strategy: Strategy, arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int
) -> Floats:
    """T_base_fixture (4, 4) as the readings of a run have it, whatever strategy made them; for the next pose."""
    if isinstance(strategy, Registered):
        return strategy.T_base_fixture
    registered = Registered(arm, optics, T_base_fixture, first)
    for step in run.trace:
        if np.isfinite(step.spots_m).all():
            registered.learn(step.q_rad, step.spots_m)
    return registered.T_base_fixture


REGISTERED = CentringChoice()  # what sessions use
