"""What a person puts the probe on (a cone, one end of a bar, a spot of a sphere), the reading taken there, and its
judge; who moves the probe, a person or an emulated hand, and what either is asked for.

A reading is the mean of the encoders while the probe was held. Whether it can be is judged by the arm as known so far,
which is passed in, for fits are not made here. The posture that fills the emptiest of the ranges of the joints is asked
for next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.samples import Cell

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Cone:
    """Cone `id`, about at `point_m` in the base."""

    id: int
    point_m: Vector

    @property
    def says(self) -> str:
        return f"cone {self.id}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        """Its row, in the words of samples.csv."""
        return {"seat": self.id}


@dataclass(frozen=True)
class BarEnd:
    """End a or b of a bar as it is set up in one of its positions."""

    position: int
    bar: int
    end: str
    point_m: Vector

    @property
    def says(self) -> str:
        return f"end {self.end} of bar {self.bar}, position {self.position}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        return {"bar": self.bar, "bar_end": self.end}


@dataclass(frozen=True)
class SphereSpot:
    """A sphere touched from the side of `direction` (unit); `point_m` is then the middle of the probe's ball."""

    id: int
    direction: Vector
    series: int  # touches of one number are of one test, made with the probe about alike (guided/plan.py)
    point_m: Vector

    @property
    def says(self) -> str:
        x, y, z = self.direction
        return f"sphere {self.id} from ({x:+.1f}, {y:+.1f}, {z:+.1f}), series {self.series}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        return {"sphere": self.id, "series": self.series}


Target = Cone | BarEnd | SphereSpot


@dataclass(frozen=True)
class Contact:
    """What a ball at the flange of a robot rests in or against; where that is in the base, is unknown."""

    kind: Literal["seat", "plane"]
    id: int
    says: str  # "place 2, socket 1 (seat 3)"
    place: int = 0  # the block's, of a socket

    @property
    def columns(self) -> Mapping[str, Cell]:
        return {self.kind: self.id}


Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reading:
    """A row of the samples in the making."""

    target: Target | Contact
    q_rad: Floats  # (n,)
    t_s: float  # since the session began, of the encoders' own time
    host_s: float

    def row(self) -> dict[str, Cell]:
        """Column name -> value; names of the session-folder format, version 1."""
        angles = {f"q{i + 1}_rad": float(q) for i, q in enumerate(self.q_rad)}
        return {"t_s": self.t_s, **angles, **self.target.columns}


@dataclass(frozen=True)
class OffTarget:
    """How far a reading is from where it should be."""

    miss_m: float
    sigmas: float  # of all that is not known yet, arm and noise together

    @property
    def says(self) -> str:
        return f"{1e3 * self.miss_m:.2f} mm ({self.sigmas:.0f} sigma) off; the probe slipped or sits on the rim"


class Judge(Protocol):
    """Learns from what was accepted."""

    def learn(self, readings: Sequence[Reading]) -> None: ...

    def off_target(self, visit: Sequence[Reading]) -> OffTarget | None:
        """Of the readings of one visit, against all learned; None where nothing speaks against them."""
        ...

    @property
    def repeatability_m(self) -> float | None:
        """Rms of the probe about its place in each cone, three axes together; None before any was taken twice."""
        ...


Counts = NDArray[np.int64]
STEP_RAD = np.pi / 6.0  # a disc off centre shows once a turn: a dozen steps see it whole
NEAR_RAD = 0.5  # a posture this near an earlier one in the same place shows half of what a far one shows


class Coverage:
    """Counts readings by joint and step of its range; owned by one session."""

    def __init__(self, lower_rad: Floats, upper_rad: Floats) -> None:
        self._lower_rad = lower_rad
        self._steps = np.maximum(np.ceil((upper_rad - lower_rad) / STEP_RAD - 1e-9), 1.0).astype(np.int64)
        self._counts: list[Counts] = [np.zeros(steps, dtype=np.int64) for steps in self._steps]

    def add(self, q_rad: Floats) -> None:
        """One more reading (n,)."""
        for joint, step in enumerate(self._step_of(q_rad[np.newaxis])[0]):
            self._counts[joint][step] += 1

    @property
    def shares(self) -> tuple[float, ...]:
        """Of every joint, how many of its steps have been visited, 0 to 1."""
        return tuple(float(np.mean(counts > 0)) for counts in self._counts)

    def marks(self, joint: int) -> str:
        """A joint's range for a person, step by step: "·" never, "▪" once, "█" more often."""
        return "".join("·▪█"[min(int(count), 2)] for count in self._counts[joint])

    def best(self, candidates_rad: Floats, earlier_rad: Sequence[Floats]) -> Floats:
        """Of postures (row, n) the one (n,) in the emptiest steps and far from earlier ones in the same place."""
        steps = self._step_of(candidates_rad)
        empty = sum(1.0 / (1.0 + self._counts[joint][steps[:, joint]]) for joint in range(len(self._counts)))
        score = np.asarray(empty, dtype=np.float64)
        for other_rad in earlier_rad:
            apart_rad = np.abs(candidates_rad - other_rad).max(axis=1)
            score = score - 0.5 * np.exp2(-apart_rad / NEAR_RAD)
        return candidates_rad[int(np.argmax(score))]

    def _step_of(self, q_rad: Floats) -> NDArray[np.int64]:
        step = np.floor((q_rad - self._lower_rad) / STEP_RAD).astype(np.int64)
        return np.clip(step, 0, self._steps - 1)


@dataclass(frozen=True, eq=False)
class Request:
    """Put the probe there, about in this posture."""

    target: Target
    posture_rad: Floats  # (n,)
    attempt: int  # from 1


@dataclass(frozen=True, eq=False)
class GuidedProgress:
    """How the session stands, for the eye."""

    done: int  # readings
    planned: int
    says: str  # what the probe does, or what was wrong
    q_rad: Floats  # (n,) now; nan before the first sample
    request: Request
    coverage: Coverage
    repeatability_m: float | None  # scatter of the probe in its seats by the arm as known so far


class Guide(Protocol):
    """As the session reports it."""

    def ask(self, request: Request) -> bool:
        """False: who moves the probe reports that it does not get there; another posture will be asked for."""
        ...

    def tell(self, progress: GuidedProgress) -> None:
        """Now and then, and at every change."""
        ...
