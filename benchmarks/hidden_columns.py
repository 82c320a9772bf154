"""`python -m benchmarks.hidden_columns FOLDER OUT`: real recordings, columns of which were hidden; real.html.

The hidden column is known to us, so here truth is real and not simulated. A cause that is not recorded can only be met
as something that changes with time; if the inferred course over time is that of the hidden column, the diagnosis saw
the cause through the arm. Where a joint column is hidden, the model of all other poses has to find where that joint
stood from what the instrument measured.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.table import Table

from acquisition.recording import Recording, Samples, read
from acquisition.recording.session_folder import CSV, RIG, write_csv
from calibeam.console import Console
from calibeam.prove.diagnosing import Answered, diagnose_cases
from calibeam.prove.prove import ending_early, fresh
from calibeam.prove.seal import Layout
from calibeam.software import SOFTWARE
from calibrate.diagnose.assess.unseen_rows import splits_of
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.record.schema import CurveRecord, DiagnosisFile
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.errors import DataError
from calibrate.model.chain import SensorChain
from calibrate.quantities import DASH, angle, length
from calibrate.report.diagnosis.diagnosis_page import write_diagnosis_report
from calibrate.report.diagnosis.words import verdict_words
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    page,
    section,
    table,
    tag,
    write_page,
)
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import Tone

Floats = NDArray[np.float64]

FEWEST = 20  # points of a curve
JOBS = 2  # processes


@dataclass(frozen=True)
class HiddenColumn:
    """One inferred course over time against the hidden one."""

    column: str
    where: str
    physics: str
    correlation: float  # of the inferred course and the hidden column
    says: str


def against_hidden(file: DiagnosisFile, samples: Samples, column: str) -> tuple[HiddenColumn, ...]:
    """Every finding that depends on time; none where the diagnosis inferred nothing slow."""
    out: list[HiddenColumn] = []
    for finding in file.findings:
        curve = finding.curve
        if curve is None or "t" not in finding.depends_on.split(","):
            continue
        r = _correlation(curve, samples, column)
        if r is not None:
            out.append(HiddenColumn(column, finding.where, finding.physics, r, finding.says))
    return tuple(out)


def _correlation(curve: CurveRecord, samples: Samples, column: str) -> float | None:
    """None for a curve of a few points, or one that does not change."""
    pairs = [(t, y) for t, y in zip(curve.values, curve.fitted, strict=True) if t is not None and y is not None]
    if len(pairs) < FEWEST:
        return None
    t_s, course = np.array(pairs).T
    recorded_s, hidden = samples.column("t_s"), samples.column(column)
    good = np.isfinite(hidden)
    order = np.argsort(recorded_s[good], kind="stable")
    there = np.interp(t_s, recorded_s[good][order], hidden[good][order])
    if np.ptp(course) == 0.0 or np.ptp(there) == 0.0:
        return None
    return float(np.corrcoef(course, there)[0, 1])


Ints = NDArray[np.intp]

STARTS = 48  # over the range of the joint: arms may reach a point with an angle far off
STEPS = 12
SETTLED_RAD = 1e-9
FAINT_RAD = 0.01  # by which an angle has to be known: the target of a joint beside it shows nothing
SEED = 5


@dataclass(frozen=True)
class HiddenAngle:
    """What was inferred of one joint at the poses that had its column hidden."""

    joint: int  # from 1
    poses: int
    rms_rad: float | None  # inferred less recorded; None where no pose feels the joint
    expected_rad: float | None  # from what the model misses at other unseen poses, and how the joint is felt
    unfelt: int  # poses at which the target stands next to the joint's axis: left out
    misses: tuple[float, ...] = ()  # inferred less recorded over the sigma stated of that pose, in order of poses


def hidden_angles(recording: Recording) -> tuple[HiddenAngle, ...]:
    """Of every joint. DataError where the session has no instrument that sees single poses."""
    state = fit_geometry(session_of(recording.rig, recording.samples))
    samples = np.unique(state.rows.sample[state.rows.data])
    test = splits_of(state.drivers, samples, np.random.default_rng(SEED))[0].unseen[0]
    known_rows = np.setdiff1d(samples, test)
    tried = splits_of(state.drivers, known_rows, np.random.default_rng(SEED))[0].unseen[0]
    misfit = _misfit(state.select(np.setdiff1d(known_rows, tried)).refitted(()), tried)
    known = state.select(known_rows).refitted(())
    return tuple(_hidden(known, test, joint, misfit) for joint in range(known.session.arm.n_joints))


def _at(state: Fitted, samples: Ints) -> tuple[SensorChain, Floats, Floats, Floats]:
    """The first instrument at these samples: chain, values of its parameters, what it saw, joint readings."""
    measured = state.session.measured[0]
    chain = measured.problem.chain
    if not isinstance(chain, SensorChain):
        raise DataError("the first instrument of this session sees pairs of poses; hide an angle from another one")
    rows = np.flatnonzero(np.isin(measured.sample_rows[:, -1], samples))
    values = state.session.weighting.unweighted.of_block(0, state.geometry)
    return chain.select(rows), values, measured.problem.observed[rows], measured.problem.q_rad[rows]


def _misfit(state: Fitted, unseen: Ints) -> float:
    """Rms of what a model misses at poses that it was not fitted to, all their columns known."""
    chain, values, observed, q_rad = _at(state, unseen)
    return float(np.sqrt(np.mean((observed - chain.expect(values, q_rad)) ** 2)))


def _hidden(state: Fitted, test: Ints, joint: int, misfit: float) -> HiddenAngle:
    """`misfit`: known from other poses, for the uncertainty of an angle may not hang on the angle that is hidden."""
    chain, values, observed, q_rad = _at(state, test)
    limits = state.session.rig.arm.joints[joint]
    found = _inferred(chain, values, observed, q_rad, joint, (limits.lower_rad, limits.upper_rad))
    away = np.angle(np.exp(1j * (found - q_rad[:, joint])))
    inferred_rad = q_rad.copy()
    inferred_rad[:, joint] = found
    felt = np.linalg.norm(chain.by_joint(values, inferred_rad)[:, :, joint], axis=1)
    sure = FAINT_RAD * felt > misfit
    return HiddenAngle(
        joint + 1,
        int(sure.sum()),
        float(np.sqrt(np.mean(away[sure] ** 2))) if sure.any() else None,
        misfit * float(np.sqrt(np.mean(felt[sure] ** -2.0))) if sure.any() else None,
        int(np.sum(~sure)),
        tuple((away[sure] * felt[sure] / misfit).tolist()),
    )


def _inferred(
    chain: SensorChain, values: Floats, observed: Floats, q_rad: Floats, joint: int, limits: tuple[float, float]
) -> Floats:
    """(pose,) the angle that fits best: the best of a grid, then Gauss-Newton."""
    grid = np.linspace(*limits, STARTS)
    q = q_rad.copy()
    errors: list[Floats] = []
    for value in grid:
        q[:, joint] = value
        errors.append(np.sum((observed - chain.expect(values, q)) ** 2, axis=1))
    q[:, joint] = grid[np.argmin(np.stack(errors), axis=0)]
    for _ in range(STEPS):
        slope = chain.by_joint(values, q)[:, :, joint]
        left = observed - chain.expect(values, q)
        step = np.sum(slope * left, axis=1) / np.maximum(np.sum(slope**2, axis=1), 1e-300)
        q[:, joint] += np.clip(step, grid[0] - grid[1], grid[1] - grid[0])
        if float(np.max(np.abs(step))) < SETTLED_RAD:
            break
    return q[:, joint]


ROOM = "temp_room_degC"
BLIND = "-blind"  # of the name of a recording with a column hidden
MOST_SAMPLES = 1000  # of a long session: every n-th row, over the whole of its time


class RealScore(msgspec.Struct, frozen=True):
    """One set. Its truth is unknown: error on unseen samples, and hidden columns, are all that counts."""

    name: str
    samples: int
    error: str
    diagnosis: DiagnosisFile | None
    angles: tuple[HiddenAngle, ...]
    columns: tuple[HiddenColumn, ...]
    blind: DiagnosisFile | None = None  # without the room's temperature; None where the file has none


def real_sets(data: Path) -> tuple[Path, ...]:
    """Session folders in a folder. DataError where there are none."""
    found = tuple(sorted(p.parent for p in data.glob(f"*/{RIG}") if (p.parent / CSV).is_file()))
    if not found:
        raise DataError(f"{data}: no session folder with {RIG} and {CSV} in it; give the folder that holds them")
    return found


def prove_real(data: Path, out: Path, jobs: int, tell: Callable[[str], None]) -> tuple[RealScore, ...]:
    """Every set of a folder, diagnosed by processes that see only what is not hidden."""
    layout = Layout(out)
    sets = {folder.name: thinned(read(folder)) for folder in real_sets(data)}
    names: list[str] = []
    for name, recording in sets.items():
        names += _laid_out(layout, name, recording)
    answers: dict[str, Answered] = {}
    with closing(diagnose_cases(layout, names, jobs)) as coming:
        for answer in coming:
            answers[answer.name] = answer
            tell(f"diagnosed {answer.name}" + (f": {answer.error}" if answer.error else ""))
    return tuple(_scored(layout, name, recording, answers) for name, recording in sets.items())


def thinned(recording: Recording) -> Recording:
    """Every n-th sample, so that no more than `MOST_SAMPLES` are left."""
    step = -(-len(recording.samples) // MOST_SAMPLES)
    if step == 1:
        return recording
    return replace(recording, samples=recording.samples.take(np.arange(0, len(recording.samples), step)))


def _laid_out(layout: Layout, name: str, recording: Recording) -> Sequence[str]:
    """Writes the recording, and once more without a column that it has."""
    _write(layout.recording(name), recording, ())
    if ROOM not in recording.samples:
        return (name,)
    _write(layout.recording(name + BLIND), recording, (ROOM,))
    return (name, name + BLIND)


def _write(folder: Path, recording: Recording, hidden: Sequence[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RIG).write_text(recording.rig_text, encoding="utf-8")
    kept = {name: values for name, values in recording.samples.columns.items() if name not in hidden}
    write_csv(Samples(kept, recording.samples.n_joints), folder / CSV)


def _scored(layout: Layout, name: str, recording: Recording, answers: Mapping[str, Answered]) -> RealScore:
    if answers[name].error:
        return RealScore(name, len(recording.samples), answers[name].error, None, (), ())
    file = read_diagnosis(layout.answer(name) / "diagnosis.json")
    write_diagnosis_report(layout.out / f"{name}.html", recording, file)
    columns: tuple[HiddenColumn, ...] = ()
    blind: DiagnosisFile | None = None
    if name + BLIND in answers and not answers[name + BLIND].error:
        blind = read_diagnosis(layout.answer(name + BLIND) / "diagnosis.json")
        columns = against_hidden(blind, recording.samples, ROOM)
    return RealScore(name, len(recording.samples), "", file, hidden_angles(recording), columns, blind)


LEAD = (
    "The truth of a real recording is unknown. What counts is the error on samples that no fit has seen, and what is "
    "inferred of a column that the file has and the model was not given."
)
HEAD = ("", "samples", "unseen samples, geometry", "with what was found", "noise, as it is known", "found")
ANGLES = ("hidden", "poses", "inferred less recorded, rms", "uncertainty stated before", "poses that do not feel it")
SHADED_SIGMAS = 2.0  # sigmas that the figure shades
MOST = 6.0  # sigmas that it shows


def write_real_page(path: Path, sets: Sequence[RealScore], software: str) -> Path:
    """One HTML file at `path`, beside the pages of the sets; returns it. DataError where it cannot be written."""
    return write_page(path, real_html(sets, software))


def real_html(sets: Sequence[RealScore], software: str) -> str:
    """The page as text."""
    masthead = tag(
        "header",
        tag("p", "Real recordings, columns kept back", cls="kicker"),
        tag("h1", f"{len(sets)} real recordings"),
        tag("p", software, cls="byline"),
    )
    contents = {"sets": "All sets", **{one.name: one.name for one in sets}}
    return page("Real recordings", masthead, contents, [_all(sets), *map(_set, sets)], software, kind="real recordings")


def _all(sets: Sequence[RealScore]) -> Html:
    return section("sets", "All sets", LEAD, table(HEAD, [_row(one) for one in sets], numeric=(1, 2, 3, 4)))


def _row(one: RealScore) -> tuple[str, ...]:
    file = one.diagnosis
    if file is None:
        return (one.name, str(one.samples), f"failed: {one.error}")
    found = ", ".join(f"{f.physics} at {f.where}" for f in file.findings) or file.verdict
    return (one.name, str(one.samples), _m(file.rms_before_m), _m(file.rms_after_m), _m(file.noise_floor_m), found)


def _set(one: RealScore) -> Html:
    file = one.diagnosis
    if file is None:
        return section(one.name, one.name, f"The diagnosis failed: {one.error}.")
    said = [f.says for f in file.findings] + _unexplained(file)
    whole = tag("p", tag("a", "The whole diagnosis", href=f"{one.name}.html"), f" · {one.samples} samples")
    return section(one.name, one.name, verdict_words(file), bullets(said), whole, *_angles(one), *_room(one))


def _unexplained(file: DiagnosisFile) -> list[str]:
    left = [u for u in (file.unexplained, *file.also_unexplained) if u is not None]
    return [f"Unexplained: {u.says}" for u in left] or ["Nothing that remains has a structure that was seen."]


def _angles(one: RealScore) -> list[Html]:
    """Nothing where no joint could be hidden."""
    if not one.angles:
        return []
    rows = [
        (f"joint {a.joint}", str(a.poses), _rad(a.rms_rad), _rad(a.expected_rad), str(a.unfelt)) for a in one.angles
    ]
    caption = "Each joint in turn hidden at a fifth of the poses, inferred from what the instrument saw"
    found = [table(ANGLES, rows, numeric=(1, 2, 3, 4), caption=caption)]
    if any(a.misses for a in one.angles):
        says = f"Of {one.name}: hidden angles, inferred less recorded, over the uncertainty stated before."
        drawing = drawn(f"angles-{one.name}", says, 7.0, 2.6, lambda figure: _paint(figure, one.angles))
        found.append(
            figure(drawing, "Shaded: twice the stated uncertainty. 95 % are inside if the uncertainty is right.")
        )
    return found


def _paint(figure: Figure, angles: Sequence[HiddenAngle]) -> None:
    axes = figure.subplots()
    axes.axhspan(-SHADED_SIGMAS, SHADED_SIGMAS, color=Tone.FAINT.value)
    for hidden in angles:
        n = len(hidden.misses)
        across = [hidden.joint + 0.7 * ((i + 0.5) / n - 0.5) for i in range(n)]
        axes.plot(across, hidden.misses, ".", color=Tone.PLACE_1.value, markersize=4.0)
        if not n:
            axes.text(hidden.joint, 0.0, "not felt", ha="center", va="center", color=Tone.SOFT.value, fontsize=8.0)
    axes.set(ylim=(-MOST, MOST), xlabel="hidden joint", ylabel="sigmas", xlim=(0.5, len(angles) + 0.5))
    axes.set_xticks([a.joint for a in angles])


def _room(one: RealScore) -> list[Html]:
    """What was reported without the room's temperature, where the file has it."""
    if one.blind is None or one.diagnosis is None:
        return []
    with_it, without = ([f"{f.physics} at {f.where}" for f in file.findings] for file in (one.diagnosis, one.blind))
    same = "the same" if with_it == without else ", ".join(without) or one.blind.verdict
    lines = [f"Diagnosed once more without {ROOM}: {same}."]
    lines += [
        f"{c.physics} at {c.where} was found to change with time; its course and the hidden temperature: correlation "
        f"{c.correlation:.2f}."
        for c in one.columns
    ]
    if not one.columns:
        lines.append("Nothing was found that changes with time, so nothing was inferred of the temperature.")
    return [bullets(lines)]


def _m(value: float | None) -> str:
    return DASH if value is None else length(value)


def _rad(value: float | None) -> str:
    return DASH if value is None else angle(value)


def print_real(console: Console, sets: Sequence[RealScore]) -> None:
    """What is found in real recordings, what remains, and what is inferred of hidden columns."""
    table = Table(title="real recordings", title_justify="left")
    for heading in ("set", "samples", "verdict", "geometry, held out", "with physics", "found"):
        table.add_column(heading)
    for one in sets:
        file = one.diagnosis
        if file is None:
            table.add_row(one.name, str(one.samples), f"failed: {one.error}")
            continue
        found = ", ".join(f"{f.physics} at {f.where}" for f in file.findings)
        before, after = _um(file.rms_before_m), _um(file.rms_after_m)
        table.add_row(one.name, str(one.samples), file.verdict, before, after, found)
    console.print(table)
    for one in sets:
        for a in one.angles:
            console.print(f"{one.name}: {_angle(a)}", highlight=False)
        for c in one.columns:
            said = f"{one.name}: {c.column} hidden: {c.physics} at {c.where} over time, correlation {c.correlation:.2f}"
            console.print(said, highlight=False)


def _um(value: float | None) -> str:
    return "-" if value is None else f"{1e6 * value:.3g} µm"


def _angle(hidden: HiddenAngle) -> str:
    if hidden.rms_rad is None or hidden.expected_rad is None:
        return f"joint {hidden.joint} hidden: the target sits on its axis and does not depend on it"
    return (
        f"joint {hidden.joint} hidden at {hidden.poses} poses: inferred to {1e6 * hidden.rms_rad:.0f} µrad rms, "
        f"expected {1e6 * hidden.expected_rad:.0f}; poses that do not depend on it: {hidden.unfelt}"
    )


def main(data: Path, to: Path) -> None:
    """Pages of all sets, real.html and real.json in the empty folder `to`."""
    console, folder = Console(), fresh(to).out
    with ending_early(to, lambda word: console.print(word, markup=False), "it begins with an empty folder") as count:
        sets = prove_real(data, folder, JOBS, count)
    (to / "real.json").write_bytes(msgspec.json.format(msgspec.json.encode(sets), indent=1) + b"\n")
    write_real_page(to / "real.html", sets, SOFTWARE)
    print_real(console, sets)
    print(f"page: {to / 'real.html'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
