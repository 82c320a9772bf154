"""The emulated world: what is true, advanced by emulated time, never reading a clock, all randomness from one seed.

    world = World.from_rig(tomllib.loads(text))
    world.command(q_rad); world.advance(0.002); world.photocurrents_a(times_s)

With `hidden` mechanisms (simulators/defects) at work, arm and light are what they make of them.

Instruments (simulators/<device>) read it through `joints`, `link_encoders_rad` and `photocurrents_a`; `truth`, `beam`,
`spots` and `T_base_flange` are taps for tests and go over no wire. The joints' own noise is their quantisation only.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from simulators.arm.kinematics import moved
from simulators.defects import Defect
from simulators.errors import WorldError
from simulators.world.body import ArmBody
from simulators.world.model import STEP_S
from simulators.world.moving_mechanisms import (
    MovingMechanisms,
    fixture_at,
    joint_temperature_degC,
    psd_temperature_degC,
    seen,
)
from simulators.world.optics import (
    DARK,
    EDGE_S,
    ELECTRODES,
    NOISE_RATE_HZ,
    Face,
    Knot,
    Photodetectors,
    Ray,
    Spots,
    interpolate,
    place_faces,
    sample_a,
    trace,
)
from simulators.world.rig import Pose, WorldRig, read_rig
from simulators.world.torque_mechanisms import TorqueMechanisms, with_true_masses
from simulators.world.truth import Given, Truth, arm_of, draw_truth, given_truth

Floats = NDArray[np.float64]
NO_FIXTURE = 0
HELD_STEPS = 10  # of a moving arm, between two evaluations of hidden mechanisms
HELD_S = 0.050  # of a standing one: what drifts does so in minutes


@dataclass(frozen=True)
class JointState:
    """What the controller's own sensors report, each (n,)."""

    q_rad: Floats
    qd_rad_s: Floats
    torque_nm: Floats
    temperature_degC: Floats


class World:
    """Arm, laser and fixture. Starts standing at `q_rad`, with the fixture at the rig's first place."""

    def __init__(
        self,
        rig: WorldRig,
        truth: Truth,
        q_rad: ArrayLike | None = None,
        hidden: Sequence[Defect] = (),
        rest_degC: Mapping[str, float] | None = None,
    ) -> None:
        """`q_rad`: (n,) readings at power-on, zero when not given. WorldError when their number is wrong."""
        if truth.psd2_in_psd1 is not None and rig.fixture is not None:
            fixture = msgspec.structs.replace(rig.fixture, psd2_in_psd1=truth.psd2_in_psd1)
            rig = msgspec.structs.replace(rig, fixture=fixture)
        repeat_seed, noise_seed = np.random.SeedSequence([truth.seed, 2]).spawn(2)
        self.truth = truth
        self.n_joints = len(truth.links)
        start_rad = self._checked(np.zeros(self.n_joints) if q_rad is None else q_rad)
        stated, rig = rig, with_true_masses(rig, hidden)
        self._hidden = MovingMechanisms(hidden, arm_of(rig, truth)) if hidden else None
        self._body = ArmBody(
            rig,
            truth,
            start_rad,
            np.random.default_rng(repeat_seed),
            self._hidden,
            rest_degC,
            TorqueMechanisms(hidden, self.n_joints) if hidden else None,
            stated if stated is not rig else None,
        )
        self._detectors = (
            None
            if rig.fixture is None
            else Photodetectors(rig.fixture.half_size_m, rig.emulation.laser_power_w, rig.emulation.psd_noise_m)
        )
        self._noise = np.random.default_rng(noise_seed)
        self._quantise = quantiser([joint.encoder_counts for joint in rig.arm.joint])
        self._fixture = rig.fixture
        self._places: dict[int, Pose] = {place.id: place.psd1_in_base for place in truth.placements}
        self._faces_at: dict[int, tuple[Face, Face]] = {}
        if rig.fixture is not None:
            self._faces_at = {place: place_faces(rig.fixture, pose) for place, pose in self._places.items()}
        self._placement = truth.placements[0].id if self._faces_at else NO_FIXTURE
        self._rate_hz = NOISE_RATE_HZ
        self._steps = 0
        self._felt_step = 0
        self._faces = self._feel()
        self._knots = [Knot(self._body.beam())]
        self._knots_start_s = 0.0

    @classmethod
    def from_rig(
        cls,
        rig: Mapping[str, Any],
        *,
        seed: int | None = None,
        q_rad: ArrayLike | None = None,
        hidden: Sequence[Defect] = (),
        given: Given | None = None,
    ) -> "World":
        """The world of a rig as `tomllib` gives it; `seed` goes before the one in [emulation]. WorldError if bad.

        `given`: its geometry in numbers, instead of a drawn one.
        """
        checked = read_rig(rig)
        of = checked.emulation.seed if seed is None else seed
        if given is None:
            return cls(checked, draw_truth(checked, of), q_rad, hidden)
        return cls(checked, given_truth(checked, of, given), q_rad, hidden, given.rest_degC)

    # --- time and action

    @property
    def time_s(self) -> float:
        """Emulated seconds since power-on: whole physics steps."""
        return self._steps * STEP_S

    def command(self, q_rad: ArrayLike) -> None:
        """Set-point (n,) in the controller's own readings, held until the next. WorldError unless n finite numbers."""
        self._body.aim(self._checked(q_rad), self.time_s)

    def advance(self, until_s: float) -> None:
        """Physics up to that time, in steps of 1 ms; what is left of a step waits for the next call."""
        last = math.floor(until_s / STEP_S + 1e-6)
        self._knots = [self._knots[-1]]
        self._knots_start_s = self.time_s
        while self._steps < last and not self._body.stands:
            self._body.step()
            self._steps += 1
            if self._hidden is not None and (self._body.stands or self._steps - self._felt_step >= HELD_STEPS):
                self._faces = self._feel()
            self._knots.append(Knot(self._body.beam()))
        self._steps = max(self._steps, last)
        if self._hidden is not None and self._steps - self._felt_step >= HELD_S / STEP_S:
            self._faces = self._feel()
            self._knots.append(Knot(self._body.beam()))

    def place_fixture(self, placement_id: int) -> None:
        """Puts the fixture at one of the rig's places at once; 0 takes it away. WorldError on an unknown place."""
        if placement_id != NO_FIXTURE and placement_id not in self._places:
            known = ", ".join(str(known_id) for known_id in self._places)
            raise WorldError(
                f"fixture: no placement {placement_id!r}; the rig has {known}, and 0 takes the fixture away"
            )
        self._placement = placement_id
        self._faces = self._feel()
        self._knots = [Knot(self._body.beam())]

    def psd_rate(self, rate_hz: float) -> None:
        """The sampling rate whose bandwidth sets the noise of `photocurrents_a`."""
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise WorldError(f"PSD sampling rate {rate_hz!r} Hz; give a positive number")
        self._rate_hz = rate_hz

    # --- what instruments see

    def joints(self) -> JointState:
        q_rad = self._quantise(self._body.reading_rad())
        temperature_degC = np.full(self.n_joints, joint_temperature_degC(self.time_s))
        return JointState(q_rad, self._body.speed_rad_s(), self._body.torque_nm().copy(), temperature_degC)

    def mass_matrix_kg_m2(self, q_rad: ArrayLike) -> Floats:
        """(n, n) of links and tool at the readings `q_rad` (n,), without the rotors. WorldError as `command`."""
        return self._body.mass_matrix_kg_m2(self._checked(q_rad))

    def load_nm(self, q_rad: ArrayLike, qd_rad_s: ArrayLike) -> Floats:
        """(n,) torques of gravity, Coriolis and centrifugal forces at readings and joint speeds, each (n,)."""
        return self._body.load_nm(self._checked(q_rad), self._checked(qd_rad_s))

    def link_encoders_rad(self) -> Floats:
        """(n,) what encoders at the links see: true angle and their own mounting offset, not quantised."""
        return self._body.true_rad() + self.truth.link_encoder_offset_rad

    @property
    def psd_temperature_degC(self) -> float:
        return psd_temperature_degC(self.time_s)

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats:
        """(sample, 8) A: psd1 x1, x2, y1, y2, psd2 x1, x2, y1, y2, with noise, at times of the last advance.

        The noise is drawn in order of the samples, so the same sequence of times gives the same numbers however the
        calls are grouped. WorldError for a time that is not between the previous advance and now.
        """
        times = times_s if isinstance(times_s, list) else [float(time_s) for time_s in times_s]
        if not times:
            return np.empty((0, ELECTRODES))
        first_s, last_s = min(times), max(times)
        if not (first_s >= self._knots_start_s - EDGE_S and last_s <= self.time_s + EDGE_S):
            raise WorldError(
                f"photocurrents from {first_s:.6f} to {last_s:.6f} s are not within the last advance "
                f"({self._knots_start_s:.6f} to {self.time_s:.6f} s); sample after every advance"
            )
        if len(self._knots) == 1:  # the arm stands
            return sample_a(self._knots[0].seen(self._see)[None], self._rate_hz, self._noise, len(times))
        return sample_a(interpolate(self._knots, self._knots_start_s, times, self._see), self._rate_hz, self._noise)

    def _see(self, beam: Ray) -> Floats:
        if self._detectors is None:
            raise WorldError("photocurrents: this rig has no [fixture], so that there are no detectors")
        return self._detectors.see(self._spots(beam))

    def _spots(self, beam: Ray) -> Spots:
        if self._faces is None:
            return DARK
        spots = trace(beam, self._faces)
        return spots if self._hidden is None else seen(spots, beam, self._faces, self._hidden)

    def _feel(self) -> tuple[Face, Face] | None:
        """Has hidden mechanisms work on what is here and now; the faces where the fixture then stands."""
        self._felt_step = self._steps
        self._body.feel(self.time_s, self._placement)
        if self._placement not in self._faces_at:
            return None
        if self._hidden is None or self._hidden.fixture is None or self._fixture is None:
            return self._faces_at[self._placement]
        return place_faces(self._fixture, fixture_at(self._places[self._placement], self._hidden.fixture))

    def target_position_m(self) -> Floats:
        """(3,) of the target in the frame of the tracker, as it would give it without noise."""
        target = self._body.T_base_flange() @ np.array([*self.truth.target_m, 1.0])
        device = moved(self.truth.device.origin_m, self.truth.device.rotation_rad)
        if self._hidden is None:
            return device[:3, :3].T @ (target[:3] - device[:3, 3])
        return self._hidden.seen_position_m(target[:3], device)

    def T_base_psd1(self) -> Floats | None:
        """Where PSD 1 stands, (4, 4), as an observer of the fixture sees it; None without a fixture."""
        face = None if self._faces is None else self._faces[0]
        if face is None:
            return None
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([face.axis_x, face.axis_y, face.normal])
        pose[:3, 3] = face.centre_m
        return pose

    # --- taps on the truth, for tests

    def beam(self) -> Ray:
        """The true laser beam, in the base frame."""
        return self._body.beam()

    def spots(self) -> Spots:
        """Where the beam strikes now, as a detector without noise reads it."""
        return self._spots(self._body.beam())

    def true_joints_rad(self) -> Floats:
        """(n,) true joint angles: reading + zero + repeatability."""
        return self._body.true_rad()

    def T_base_flange(self) -> Floats:
        """The true flange pose, (4, 4)."""
        return self._body.T_base_flange()

    @property
    def stands(self) -> bool:
        """True when nothing moves any more."""
        return self._body.stands

    def _checked(self, q_rad: ArrayLike) -> Floats:
        q = np.asarray(q_rad, dtype=np.float64)
        if q.shape != (self.n_joints,) or not np.isfinite(q).all():
            raise WorldError(
                f"set-point {np.asarray(q_rad).tolist()} rad; the arm takes {self.n_joints} finite numbers"
            )
        return q


def quantiser(encoder_counts: Sequence[int | None]) -> Callable[[Floats], Floats]:
    """Rounds joint angles to whole counts per turn; None leaves a joint as fine as it is."""
    counted = np.array([counts is not None for counts in encoder_counts])
    if not counted.any():
        return lambda q_rad: q_rad
    count_rad = np.array([2.0 * math.pi / (counts or 1) for counts in encoder_counts])
    return lambda q_rad: np.where(counted, np.round(q_rad / count_rad) * count_rad, q_rad)
