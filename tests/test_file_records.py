"""Every record that is read from a file bounds its numbers, texts and joints; one place reads each kind of file."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import msgspec
import pytest
from msgspec.structs import fields

from acquisition.centring.camera import model as camera
from acquisition.motion.task.task_file import TaskEntries
from acquisition.recording.mcap import read
from acquisition.recording.motion_plan import MotionPlan
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.recording.session_folder.stream_tables import StreamsAbout
from calibeam.fleet.row import Row
from calibeam.motion.task_devices import PartFile
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.error_simulation.error_plan import ErrorPlan
from calibrate.fit.fit_plan import FitPlan
from calibrate.model.model_file import ModelFile

ROOT = Path(__file__).parents[1]
RECORDS = (
    Rig,
    PosePlan,
    MotionPlan,
    FitPlan,
    ErrorPlan,
    TaskEntries,
    ModelFile,
    DiagnosisFile,
    Row,
    StreamsAbout,
    PartFile,
)
PRIVATE = (camera._File, read._ChannelRow)  # pyright: ignore[reportPrivateUsage] - records of one reader
# Read by the program that wrote them, in one run or in a sealed folder; nobody edits them.
OWN = {"Truth": "prove", "Begun": "prove", "ProofFile": "prove", "Task": "fleet", "ReconcileFile": "prove"}
OUR_READERS = {"checked", "read_json"}
READERS = {"decode", "convert", *OUR_READERS}
UPPER, LOWER = ("le", "lt"), ("ge", "gt")


def unbounded(declared: Any, where: str, seen: set[Any]) -> Iterator[str]:
    """Places within a type at which a number or a text has no bound."""
    if get_origin(declared) is Annotated:
        inner, *about = get_args(declared)
        metas = [meta for meta in about if isinstance(meta, msgspec.Meta)]
        if inner in (int, float):
            if not all(any(getattr(m, side) is not None for m in metas for side in sides) for sides in (UPPER, LOWER)):
                yield where
        elif inner is str:
            if not any(m.max_length is not None or m.pattern is not None for m in metas):
                yield where
        else:
            yield from unbounded(inner, where, seen)
    elif declared in (int, float, str):
        yield where
    elif isinstance(declared, type) and issubclass(declared, msgspec.Struct):
        if declared not in seen:
            seen.add(declared)
            for field in fields(declared):
                yield from unbounded(field.type, f"{declared.__name__}.{field.encode_name}", seen)
    elif get_origin(declared) is not Literal:
        for inner in get_args(declared):
            yield from unbounded(inner, where, seen)


@pytest.mark.parametrize("record", [*RECORDS, *PRIVATE], ids=lambda record: record.__name__)
def test_every_number_and_text_of_a_file_has_a_bound(record: type) -> None:
    assert list(unbounded(record, "", set())) == []


def test_the_walk_finds_what_has_no_bound() -> None:
    class Inner(msgspec.Struct):
        text: str
        number: Annotated[float, msgspec.Meta(ge=0.0)]
        names: dict[str, Annotated[int, msgspec.Meta(ge=0, le=3)]]

    class Outer(msgspec.Struct):
        inner: tuple[Inner, ...] | None
        kind: Literal["a", 3]

    assert list(unbounded(Outer, "", set())) == ["Inner.text", "Inner.number", "Inner.names"]


def test_no_record_is_read_from_a_file_that_is_not_walked() -> None:
    known = {record.__name__ for record in (*RECORDS, *PRIVATE)} | OWN.keys()
    found: set[str] = set()
    for package in ("acquisition", "calibrate", "calibeam"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if not any(reader in text for reader in READERS):
                continue  # parsing every file takes seconds
            for call in ast.walk(ast.parse(text)):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute | ast.Name):
                    found |= set(read_types(call))
    assert found <= known, f"add to RECORDS: {sorted(found - known)}"
    assert {"Rig", "ModelFile", "DiagnosisFile", "PosePlan", "TaskEntries"} <= found


def read_types(call: ast.Call) -> Iterator[str]:
    """Names of records that a call of a reader asks for."""
    called = call.func.attr if isinstance(call.func, ast.Attribute) else ast.unparse(call.func)
    if called in READERS:
        by_name = [keyword.value for keyword in call.keywords if keyword.arg == "type"]
        given = call.args if called in OUR_READERS else by_name
        for name in {part.id for one in given for part in ast.walk(one) if isinstance(part, ast.Name)}:
            if name.lstrip("_")[:1].isupper() and not name.isupper() and name != "Any":
                yield name
