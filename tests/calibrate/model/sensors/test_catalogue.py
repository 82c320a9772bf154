"""Sensors own themselves: their names stand in their own files, and nothing else tests what class a sensor is."""

import ast
import inspect
from pathlib import Path

import pytest

from calibrate.model import sensors
from calibrate.model.chain import Usage
from calibrate.model.sensors.catalogue import (
    BY_NAME,
    SENSORS,
    SOURCES,
    kind_of,
    names_with,
    used_with,
)
from calibrate.model.sensors.kind import Trait
from tests.support.trees import tree_of

ROOT = Path(sensors.__file__).parents[3]
MODEL = ROOT / "calibrate" / "model"
OWN = ("sensors", "optics")  # folders of sensors and of what they are made of
# Why a file may spell a sensor's name.
SPELLED = {
    "calibeam/commands/session.py": "names of the options of the command",
    "calibeam/prove": "families of the simulator's scenarios, which have the proof's own names",
    "calibeam/guided/run.py": "verbs of the emulated hand",
    "calibrate/model/older_models.py": "keys of model files of version 1",
    "calibrate/model/model_file.py": "what a model file of version 1 without the key holds",
    "calibeam/simulation/mechanism_by_hand.py": "instruments that a mechanism acts on: words of the simulators",
    "calibeam/simulation/of_instruments.py": "what a curve is added to: a word of the simulators",
    "calibrate/report/session_report.py": "id of a chapter on the page",
    "calibrate/report/sections/zeros.py": "id of a chapter on the page",
}
# Why a file may test for a sensor's class.
TESTED: dict[str, str] = {}


def product_files():
    files = [path for top in ("calibrate", "calibeam") for path in sorted((ROOT / top).rglob("*.py"))]
    return [path for path in files if not any(MODEL / own in path.parents for own in OWN)]


def excused(path, reasons):
    return any(str(path.relative_to(ROOT)).startswith(start) for start in reasons)


def sensor_classes():
    found = set()
    for path in (path for own in OWN for path in (MODEL / own).glob("*.py")):
        module = __import__(f"calibrate.model.{path.parent.name}.{path.stem}", fromlist=["_"])
        found |= {name for name, cls in inspect.getmembers(module, inspect.isclass) if issubclass(cls, Usage)}
    return found - {"Usage"}


def spelled(tree):
    return [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and n.value in BY_NAME]


def classes_tested(tree, classes):
    calls = [
        n
        for n in ast.walk(tree)
        if isinstance(n, ast.Call) and getattr(n.func, "id", "") in ("isinstance", "issubclass")
    ]
    return [n.id for call in calls for n in ast.walk(call.args[1]) if isinstance(n, ast.Name) and n.id in classes]


def test_no_other_file_spells_a_sensor_s_name():
    files = [path for path in product_files() if not excused(path, SPELLED)]
    assert len(files) > 400
    found = {str(path.relative_to(ROOT)): spelled(tree_of(path)) for path in files}
    assert {path: names for path, names in found.items() if names} == {}


def test_no_other_file_tests_for_a_sensor_s_class():
    classes = sensor_classes()
    assert {"Wire", "Seat", "DualPsd", "FullPose"} <= classes
    files = [path for path in product_files() if not excused(path, TESTED)]
    found = {str(path.relative_to(ROOT)): classes_tested(tree_of(path), classes) for path in files}
    assert {path: names for path, names in found.items() if names} == {}


def test_both_checks_find_what_they_look_for():
    tree = ast.parse("if isinstance(sensor, Wire | Seat) or name == 'wire': pass")
    assert spelled(tree) == ["wire"]
    assert classes_tested(tree, sensor_classes()) == ["Wire", "Seat"]


@pytest.mark.parametrize("start", [*SPELLED, *TESTED])
def test_every_exception_is_still_needed(start):
    place = ROOT / start
    trees = [tree_of(path) for path in ([place] if place.is_file() else place.rglob("*.py"))]
    assert any(spelled(tree) if start in SPELLED else classes_tested(tree, sensor_classes()) for tree in trees)


@pytest.mark.parametrize("kind", SENSORS, ids=lambda kind: kind.name)
def test_a_sensor_states_all_of_itself(kind):
    assert kind_of(kind.name) is kind
    assert kind.columns or Trait.BETWEEN_ENCODERS in kind.traits  # a column for each joint
    assert all((kind.title, kind.noun, kind.noise, kind.quantities))
    assert {q.unit for q in kind.quantities} | {source.unit for source in kind.noise} <= {"m", "rad"}
    assert all(name in BY_NAME for name in kind.instead_of)
    assert bool(kind.asks) <= (kind.predict is not None)


def test_names_and_sources_are_unique():
    assert len(BY_NAME) == len(SENSORS)
    for kind in SENSORS:
        assert all(SOURCES[source.name] == source for source in kind.noise)


def test_other_ways_to_use_readings_are_used_only_where_asked_for():
    assert "distance" not in [kind.name for kind in used_with(())]
    asked = [kind.name for kind in used_with(("distance",))]
    assert "distance" in asked
    assert "position" not in asked
    assert "wire" in asked


def test_traits_are_found_in_the_order_of_the_catalogue():
    assert names_with(Trait.DRUM) == ("wire",)
    assert names_with(Trait.CONES) == ("seat",)
