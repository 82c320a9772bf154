"""Beside a known model: what is new in its own recording, in a later one, and in one after a change.

Concealed rigs of every instrument, most with a hidden effect that the model has to carry. One half of each session
makes the model; the other half, which it has not seen, is taken again after a change that is drawn at random: joint
zero, length or twist of a link, target, laser, one station of the fixture, one cone, the device.
"""

import contextlib
import io
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from calibeam.cli import run
from calibrate.diagnose.record.schema import ChangedRecord, DiagnosisFile
from calibrate.model.model_file import read_model
from simulators.conceal.rig import DualPsd
from simulators.conceal.wanted import FAMILIES, ConcealError, Family
from tests.support.pairs import Change, Pair, device, laser, laser_line, link, place, seat, tool, zero

FIRST_SEED = 9100  # nothing was chosen by these
DEFECTS: tuple[tuple[str, ...], ...] = (("any",), ("any",), ())  # in turns
ENR = 2.0
MOVED_M, TURNED_RAD = (60e-6, 200e-6), (1e-4, 3e-4)  # of a change, drawn evenly
INSIDE = 3.0  # sigmas
CHANGES: dict[Family, tuple[str, ...]] = {
    "tracker": ("zero", "length", "twist", "tool", "device"),
    "wire": ("zero", "tool", "device"),
    "cones": ("zero", "tool", "cone"),
    "dual-psd": ("zero", "length", "laser shift", "laser tilt", "station", "turned station"),
}


@dataclass(frozen=True)
class Wanted:
    """A change, the physics that has to be named, and its numbers by parameter of model.json."""

    change: Change
    physics: str  # "": nothing has changed of the machine
    true: dict[str, float]


@dataclass(frozen=True)
class Changed:
    """What is wrong with the answer on the later recordings; empty: right."""

    unchanged: str
    what: str  # was changed
    named: str
    off: float  # largest |size - truth| in sigmas; nan without a size
    sigma: str  # smallest and largest, with their units


@dataclass(frozen=True)
class Answer:
    family: Family
    seed: int
    hidden: str
    own: str  # what is wrong with the answer on the model's own recording; empty: right
    later: Changed | None  # None: what was hidden follows the clock of its session, and comes again in the later rows


def run_cases(seeds: Sequence[int], families: Sequence[Family] = FAMILIES) -> Iterator[Answer]:
    for seed in seeds:
        for family in families:
            with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
                try:
                    answer = _case(Path(folder) / "pair", family, seed, DEFECTS[seed % len(DEFECTS)])
                except ConcealError:  # a seed may give a rig that reaches too few poses
                    continue
            yield answer


def _case(folder: Path, family: Family, seed: int, defects: tuple[str, ...]) -> Answer:
    pair = Pair(folder, family=family, seed=seed, defects=defects, enr=ENR)
    own = _names(_with_model(pair, pair.folder / "recording"))
    hidden = ", ".join(type(h.defect).__name__ for h in pair.case.hidden) or "nothing"
    again = any(effect.holds == "session" for effect in read_model(pair.model).effects)
    return Answer(family, seed, hidden, own, None if again else _later(pair, np.random.default_rng([seed, 16])))


def _later(pair: Pair, rng: np.random.Generator) -> Changed:
    kind = str(rng.choice(CHANGES[pair.case.wanted.family]))
    wanted = drawn_change(kind, pair, rng)
    still, found = _with_model(pair, pair.later("unchanged")), _with_model(pair, pair.later("changed", wanted.change))
    names, by = [f.physics for f in found.findings], {c.parameter: c for c in found.changed}
    sigmas = [abs(by[name].by - true) / by[name].sigma for name, true in wanted.true.items() if name in by]
    if names != ([wanted.physics] if wanted.physics else []):
        wrong = f"named {_names(found) or 'nothing'}"
    else:
        wrong = "" if set(by) == set(wanted.true) else f"sizes of {', '.join(by) or 'nothing'}"
    return Changed(_names(still), kind, wrong, max(sigmas, default=float("nan")), _range(list(by.values())))


def drawn_change(kind: str, pair: Pair, rng: np.random.Generator) -> Wanted:
    """Of a size that `MOVED_M` or `TURNED_RAD` states, in a random direction."""
    rig = pair.case.drawn.true
    by_m, by_rad = (float(rng.uniform(*r)) * float(rng.choice((-1.0, 1.0))) for r in (MOVED_M, TURNED_RAD))
    along = rng.standard_normal(3)
    shift_m = by_m * along / np.linalg.norm(along)
    turn_rad = by_rad * along / np.linalg.norm(along)
    inner = int(rng.integers(2, rig.arm.n_joints))  # joint 1 trades against the device, the last one against the tool
    if kind == "zero":
        return Wanted(zero(inner, by_rad), "joint-zero-moved", {f"joint{inner}.zero": by_rad})
    if kind == "length":
        axes = np.array([by_m, 0.0, 0.0, 0.0, 0.0, 0.0])
        return Wanted(link(inner, axes), "link-changed", {f"link{inner}.length": by_m})
    if kind == "twist":
        axes = np.array([0.0, 0.0, 0.0, by_rad, 0.0, 0.0])
        return Wanted(link(inner, axes), "link-changed", {f"link{inner}.twist": by_rad})
    if kind == "tool":
        return Wanted(tool(shift_m), "tool-moved", _by_axis("tool.{}", "xyz", shift_m))
    if kind == "cone":
        k = int(rng.integers(1, pair.case.drawn.true.instrument.cones + 1))  # type: ignore[union-attr]
        return Wanted(seat(k, shift_m), "seat-moved", _by_axis(f"seat{k}.{{}}", "xyz", shift_m))
    if kind == "device":
        return Wanted(device(10.0 * shift_m, 10.0 * turn_rad), "", {})
    if not isinstance(rig.instrument, DualPsd):
        raise ValueError(f"{kind}: no change of a rig without two detectors")
    if kind.startswith("laser"):
        moved = laser(shift_m, np.zeros(3)) if kind == "laser shift" else laser(np.zeros(3), turn_rad)
        return Wanted(moved, "laser-moved", _laser_numbers(pair, moved))
    k = int(rng.integers(1, len(rig.instrument.places) + 1))
    names = [f"placement{k}.{what}_{axis}_{unit}" for what, unit in (("shift", "m"), ("turn", "rad")) for axis in "xyz"]
    if kind == "station":
        return Wanted(place(k, shift_m), "fixture-moved", dict(zip(names, (*shift_m, 0.0, 0.0, 0.0), strict=True)))
    about_m = pair.case.drawn.nominal.instrument.places[k - 1][:3, 3]  # type: ignore[union-attr]
    turned = place(k, np.zeros(3), turn_rad, about_m)
    return Wanted(turned, "fixture-moved", dict(zip(names, (0.0, 0.0, 0.0, *turn_rad), strict=True)))


def _by_axis(name: str, axes: str, values: np.ndarray) -> dict[str, float]:
    return {name.format(axis): float(value) for axis, value in zip(axes, values, strict=True)}


def _laser_numbers(pair: Pair, change: Change) -> dict[str, float]:
    """Change of the four numbers of the laser's line."""
    drawn = pair.case.drawn
    before, after = (laser_line(drawn.nominal.instrument, r.instrument) for r in (drawn.true, change(drawn.true)))
    names = ("laser.shift_u", "laser.shift_v", "laser.tilt_u", "laser.tilt_v")
    return dict(zip(names, (after - before).tolist(), strict=True))


def _with_model(pair: Pair, recording: Path) -> DiagnosisFile:
    """diagnosis.json of a recording beside the model of the pair, through the command."""
    out = recording.with_suffix(".json")
    run(["diagnose", str(recording), "--model", str(pair.model), "--out", str(out)])
    return msgspec.json.decode(out.read_bytes(), type=DiagnosisFile)


def _names(file: DiagnosisFile) -> str:
    """What is new; empty: nothing."""
    named = [f"{f.physics} at {f.where}" for f in file.findings]
    left = [] if file.unexplained is None or named else ["unexplained"]
    return ", ".join([*named, *left])


def _range(changed: list[ChangedRecord]) -> str:
    lengths = [1e6 * c.sigma for c in changed if c.parameter.rpartition(".")[2] in LENGTHS]
    angles = [1e6 * c.sigma for c in changed if c.parameter.rpartition(".")[2] not in LENGTHS]
    parts = [f"{min(v):.1f} to {max(v):.1f} {unit}" for v, unit in ((lengths, "µm"), (angles, "µrad")) if v]
    return ", ".join(parts)


LENGTHS = ("length", "offset", "x", "y", "z", "shift_u", "shift_v", "shift_x_m", "shift_y_m", "shift_z_m")


def lines(seeds: Sequence[int]) -> Iterator[str]:
    """A row a case, then the counts."""
    answers: list[Answer] = []
    for a in run_cases(seeds):
        answers.append(a)
        yield f"{a.family:9s}{a.seed}  hidden: {a.hidden}; own: {a.own or 'nothing new'}; {_later_words(a.later)}"
    later = [a.later for a in answers if a.later is not None]
    still, moved = [c for c in later if c.what == "device"], [c for c in later if c.what != "device"]
    sized = [c for c in moved if not c.named]
    yield f"own recording: nothing new in {sum(not a.own for a in answers)} of {len(answers)}"
    yield f"unchanged later recording: nothing new in {sum(not c.unchanged for c in later)} of {len(later)}"
    yield f"the device elsewhere: nothing new in {sum(not c.named for c in still)} of {len(still)}"
    yield f"a change: named alone and with all of its sizes in {len(sized)} of {len(moved)}"
    yield f"sizes: all within {INSIDE:g} sigma in {sum(c.off <= INSIDE for c in sized)} of {len(sized)}"


def _later_words(later: Changed | None) -> str:
    if later is None:
        return "later: not asked, it follows the clock of its session"
    off = "" if np.isnan(later.off) else f", off by {later.off:.1f} sigma at most ({later.sigma})"
    return f"unchanged: {later.unchanged or 'nothing new'}; {later.what}: {later.named or 'right'}{off}"
