"""What an exported arm cannot carry: the effects of a model, as displacements of the tip over the recorded workspace.

An export holds geometry. Where the effects of the model are zero (no load, mean temperature) it is the model's arm;
elsewhere the tip is off by what they move it. Poses are drawn evenly between the smallest and largest angle that each
joint had, each under the conditions of a recorded sample; beyond, the model states nothing of its effects.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model.alignment import aligned_difference
from calibrate.model.effects.conditions import recoupled_samples
from calibrate.model.effects.ports import Perturbation
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.with_effects.acting import Acting, frames_under
from calibrate.model.with_effects.applied import effects_at, recorded_samples
from calibrate.quantities import angle, length

Floats = NDArray[np.float64]

POSES = 500  # an rms settles to a few per cent
SEED = 1  # of the poses: the same model always exports the same text
STILL_M = 1e-12  # rounding: an effect of an instrument or of the surroundings leaves the arm where it is


@dataclass(frozen=True)
class Moved:
    """Distance between the tip of the exported arm and that of the model, over the poses."""

    rms_m: float
    max_m: float

    @classmethod
    def of(cls, shift_m: Floats) -> "Moved":
        """`shift_m` (pose, 3)"""
        apart = np.linalg.norm(shift_m, axis=1)
        return cls(float(np.sqrt(np.mean(apart**2))), float(np.max(apart)))


@dataclass(frozen=True)
class NotCarried:
    """`whole`: of all effects that hold beyond their session; `each` by name; `session`: names of those that do not."""

    poses: int
    workspace: bool  # or the recorded poses, where the effects cannot be evaluated between them
    whole: Moved
    each: dict[str, Moved]
    session: tuple[str, ...]
    carried: tuple[str, ...] = ()  # names of those that the form holds

    @property
    def sentences(self) -> tuple[str, ...]:
        """For a person, one a line."""
        return tuple(self._sentences())

    def _sentences(self) -> Iterator[str]:
        where = "drawn between the recorded joint angles" if self.workspace else "of the recording"
        if self.each:
            yield (
                f"not carried: the effects of the model; over {self.poses} poses {where} they move the tip by "
                f"{_length(self.whole)}"
            )
        for name, moved in self.each.items():
            still = moved.max_m < STILL_M
            yield f"not carried: {name}: {'moves no point of the arm' if still else _length(moved)}"
        for name in self.carried:
            yield f"carried: {name}"
        for name in self.session:
            yield f"not carried: {name}: true of its own session only"


def not_carried(model: ModelFile, carried: tuple[str, ...] = ()) -> NotCarried:
    """Of a model with effects, but for those named `carried`. DataError for one without its rig, or whose effects
    cannot be evaluated.
    """
    predictor = Predictor.of(model)
    kept = recorded_samples(model, len(predictor.rig.arm.joints))
    recorded = recoupled_samples(predictor.rig.arm, kept)
    session = tuple(e.name for e in model.effects if e.holds == "session")
    try:
        return _over(model, predictor, _drawn(recorded), session, carried, workspace=True)
    except DataError:  # what the poses themselves have chosen has no meaning between them
        return _over(model, predictor, recorded, session, carried, workspace=False)


def _over(
    model: ModelFile,
    predictor: Predictor,
    samples: Samples,
    session: tuple[str, ...],
    carried: tuple[str, ...],
    *,
    workspace: bool,
) -> NotCarried:
    applied, q = effects_at(model, predictor, samples, same_session=False), samples.joints()
    nothing = Perturbation.none(len(samples), samples.n_joints)
    left = {e.after: e.name for e in model.effects if e.after}

    def shift(found: Sequence[Acting]) -> Floats:
        by = Perturbation.of_all(len(samples), samples.n_joints, (one.added for one in found))
        moved, plain = (frames_under(predictor, q, p)[:, -1] for p in (by, nothing))
        return predictor.tip_at(moved) - predictor.tip_at(plain)

    found = [a for a in applied.found if a.carried.record.name not in carried]
    each = {left.get(a.carried.record.name, a.carried.record.name): Moved.of(shift([a])) for a in found}
    return NotCarried(len(samples), workspace, Moved.of(shift(found)), each, session, carried)


def geometry_lost(model: ModelFile) -> str:
    """What the drawn arm with the identified joint zeros still is off, a motion of the whole arm aside.

    The tip of the model against that of an arm that has its zeros and its tool, at postures between the joint limits.
    """
    predictor = Predictor.of(model)
    joints = predictor.rig.arm.joints
    low, high = np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints])
    q = np.random.default_rng(SEED).uniform(low, high, (POSES, len(joints)))
    kept = {n: v for n, v in predictor.values.items() if n.endswith(".zero") or not n.startswith(("joint", "link"))}
    none = {n: v for n, v in kept.items() if not n.startswith("joint")}
    off, drawn = (
        Moved.of(aligned_difference(predictor.tip_m(q), replace(predictor, values=values).tip_m(q)))
        for values in (kept, none)
    )
    return (
        f"not carried: lengths and axes; with the offsets alone the tip differs from this model by {_length(off)}; "
        f"with no correction by {_length(drawn)} ({POSES} poses between the joint limits)"
    )


def left_by_zeros(model: ModelFile) -> tuple[str, ...]:
    """What the nominal arm with the identified zeros misses the readings by, as the model of these zeros has it."""
    at_points = ("at the measured points", model.instruments[0])
    rows = [(*at_points, model.rms_distance_before_m, model.rms_distance_after_m)]
    rows += [
        (f"on unseen rows ({p.split})", p.instrument, p.rms_distance_before_m, p.rms_distance_after_m)
        for p in model.proofs
    ]
    out = list[str]()
    for where, name, before, after in rows:
        says = angle if kind_of(name).quantities[0].unit == "rad" else length
        of = f" of {name}" if len(model.instruments) > 1 else ""
        out.append(
            f"remaining error with these offsets alone{of}, {where}: {says(after)} rms; nominal arm {says(before)}"
        )
    return (*out, *(f"unseen rows: no proof ({why})" for why in model.unproven))


def _drawn(recorded: Samples) -> Samples:
    """Poses between the recorded angles, everything else as at recorded samples: a command as far off its reading."""
    rng, q = np.random.default_rng(SEED), recorded.joints()
    like = rng.integers(len(recorded), size=POSES)
    columns = {name: values[like] for name, values in recorded.columns.items()}
    angles = rng.uniform(q.min(axis=0), q.max(axis=0), (POSES, q.shape[1]))
    for j, turned in enumerate(angles.T, start=1):
        if (command := f"cmd{j}_rad") in columns:
            columns[command] += turned - columns[f"q{j}_rad"]
        columns[f"q{j}_rad"] = turned
    return Samples(columns, recorded.n_joints)


def _length(moved: Moved) -> str:
    return f"{1e6 * moved.rms_m:.1f} µm rms, at most {1e6 * moved.max_m:.1f} µm"
