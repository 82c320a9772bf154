"""What is asked of the program, and its answers in the form in which they are frozen in `data/expected`."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

from . import agreement
from .program import Json, columns, diagnosed, identified, predicted, run_program, write_session

DATA = Path(__file__).parent / "data"
REAL = Path(__file__).parents[3] / "shared" / "data"
SESSIONS, PLANS, FORMATS = DATA / "sessions", DATA / "plans", DATA / "formats"
MODELS = FORMATS / "models"
TRUTHS = tuple(f"{number:02d}" for number in range(20))
# One session for each instrument, and the plan by which it is fitted.
FITTED = {
    "demo": "general",
    "tracker-soft-joint": "general",
    "pose-worn-bearing": "general",
    "wire-drum": "general",
    "cones-oval-ring": "general",
    "spots-and-bar-gear-ratio": "general",
    "tracker-heated-link": "every-key",
    "tracker-unknown": "modified",
}
# A model file of each kind, and the session whose first rows it predicts.
PREDICTED = {
    "spots": "demo",
    "fewest-keys": "demo",
    "position-mdh": "tracker-soft-joint",
    "position-as-mdh": "tracker-unknown",
    "position-local-poe": "tracker-heated-link",
    "full-pose": "pose-worn-bearing",
    "wire": "wire-gear",
    "seat-bar": "cones-oval-ring",
    "spots-bar": "spots-and-bar-gear-ratio",
}
ROWS = 24  # predicted of a session
ROBOTS = ("ur10-leica-a", "ur10-leica-b", "ur10-leica-d")
FIFTHS = 5


def recording(name: str) -> Path:
    return DATA / "demo.mcap" if name == "demo" else SESSIONS / name


def zeros(name: str, folder: Path) -> Json:
    """Joint zeros of one of the 20 concealed truths, or of the demo."""
    source = recording("demo")
    if name != "demo":
        table = (DATA / "zeros" / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        source = write_session(folder / name, DATA / "zeros" / "rig.toml", table)
    return agreement.parameters(identified(source, folder / f"{name}.json"), "joint")


def truth(name: str) -> list[float]:
    """True joint zeros, rad."""
    return json.loads((DATA / "truths" / "zeros.json").read_text(encoding="utf-8"))[name]


def sigmas_off(found: Json, name: str) -> dict[str, float]:
    """By how many sigmas every zero with a number is off the truth."""
    true = {f"joint{i}.zero": value for i, value in enumerate(truth(name), start=1)}
    return {zero: (of["value"] - true[zero]) / of["sigma"] for zero, of in found.items() if of is not None}


def fitted(name: str, folder: Path) -> Json:
    """All parameters, by the general fit."""
    plan = PLANS / f"{FITTED[name]}.toml"
    return agreement.parameters(identified(recording(name), folder / f"{name}.json", plan=plan))


def diagnosis(name: str, folder: Path) -> Json:
    """The whole file."""
    return diagnosed(recording(name), folder / "diagnosis.json")


def prediction(name: str, folder: Path) -> Json:
    """Of the first rows of a session, by the frozen model file."""
    samples = folder / "samples.csv"
    lines = _samples(PREDICTED[name], folder).read_text(encoding="utf-8").splitlines()
    samples.write_text("\n".join(lines[: ROWS + 1]) + "\n", encoding="utf-8")
    return dict(predicted(MODELS / f"{name}.json", samples, folder / "predicted.csv"))


def _samples(name: str, folder: Path) -> Path:
    if name != "demo":
        return recording(name) / "samples.csv"
    run_program("export", recording(name), "--out", folder / "exported")
    return folder / "exported" / "samples.csv"


def ur5(folder: Path) -> Json:
    """The 20 poses that no fit has seen: mean and largest length of the error; gross errors that were found."""
    model = identified(REAL / "ur5-tracker", folder / "ur5.json")
    errors = unseen_m(folder / "ur5.json", REAL / "ur5-tracker" / "test.csv", folder)
    return {
        "poses": len(errors),
        "mean_m": sum(errors) / len(errors),
        "max_m": max(errors),
        "left_out": len(model["blunders"]),
    }


def ur10(name: str, folder: Path, unseen: Callable[[int], bool] = lambda row: row % FIFTHS == 0) -> Json:
    """rms length of the error on the unseen rows, by the model of all others."""
    head, *rows = (REAL / name / "samples.csv").read_text(encoding="utf-8").splitlines()
    rig = REAL / name / "rig.toml"
    kept = write_session(folder / "kept", rig, [head, *(row for k, row in enumerate(rows) if not unseen(k))])
    rest = write_session(folder / "rest", rig, [head, *(row for k, row in enumerate(rows) if unseen(k))])
    model = identified(kept, folder / "model.json", plan=PLANS / "general.toml")
    errors = unseen_m(folder / "model.json", rest / "samples.csv", folder)
    rms_m = (sum(error**2 for error in errors) / len(errors)) ** 0.5
    return {"rows": len(errors), "rms_m": rms_m, "left_out": len(model["blunders"])}


def unseen_m(model: Path, samples: Path, folder: Path) -> list[float]:
    """Length of the error of each predicted position."""
    residual = predicted(model, samples, folder / "predicted.csv")
    lengths = zip(*(residual[f"r_{axis}_m"] for axis in "xyz"), strict=True)
    return [sum(one**2 for one in each if one is not None) ** 0.5 for each in lengths]


def streams(folder: Path) -> Json:
    """Every table of a recording with streams: file name -> text."""
    out = folder / "exported"
    run_program("export", FORMATS / "streams.mcap", "--out", out, "--streams")
    return {str(path.relative_to(out)): path.read_text(encoding="utf-8") for path in sorted(out.rglob("*.*"))}


def exported_demo(folder: Path) -> Json:
    return dict(columns(_samples("demo", folder)))


def round_trip(session: Path, folder: Path) -> Path:
    """The session folder made into a recording and out again."""
    shutil.copytree(session, folder / "session")
    run_program("import", folder / "session", "--out", folder / "session.mcap")
    run_program("export", folder / "session.mcap", "--out", folder / "again")
    return folder / "again"
