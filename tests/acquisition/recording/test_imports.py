"""Reading a recording needs no port: fits run where no instrument can be reached. Others come in by the faces."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.trees import tree_of

PROGRAM = """
import sys
import acquisition.recording.check_recording, acquisition.recording.mcap.read
print(sorted({"serial", "can", "canopen", "socket", "ssl", "asyncio", "drivers"} & set(sys.modules)))
"""


def test_reading_loads_no_library_of_ports() -> None:
    said = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60.0, check=True)
    assert said.stdout.strip() == "[]"


ROOT = Path(__file__).parents[3]
PACKAGE = "acquisition.recording"
FACES = (PACKAGE, *(f"{PACKAGE}.{name}" for name in ("files", "foreign", "mcap", "output", "rig", "session_folder")))
DOORS = {  # single modules that are open beside the faces: vocabularies, and what loads a library of its own
    *FACES,
    *(
        f"{PACKAGE}.{name}"
        for name in (
            "can_frames",
            "can_log",
            "check_recording",
            "recording_examinations",
            "device_clock",
            "examination",
            "files.bounds",
            "mcap.layout",
            "motion_plan",
            "pose_plan",
            "restored_stamps",
            "rig.devices",
            "rig.schema",
            "samples",
            "session_folder.folder_import",
        )
    ),
}


def test_products_come_in_by_a_face() -> None:
    reaching = set[str]()
    for folder in ("acquisition", "calibrate", "calibeam"):
        for path in (ROOT / folder).rglob("*.py"):
            if PACKAGE.replace(".", "/") in path.as_posix() or PACKAGE not in path.read_text(encoding="utf-8"):
                continue  # its own files, and those that name it nowhere: parsing all takes seconds
            for node in ast.walk(tree_of(path)):
                module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
                if module.startswith(PACKAGE) and module not in DOORS:
                    reaching.add(f"{path.relative_to(ROOT)}: {module}")
    assert not reaching


@pytest.mark.parametrize("face", FACES)
def test_a_face_has_what_it_names_and_not_more_than_fifteen(face: str) -> None:
    module = importlib.import_module(face)
    assert module.__doc__
    assert len(module.__all__) <= 15
    assert [name for name in module.__all__ if not hasattr(module, name)] == []
