"""What a site changes between two recordings is named with its size, and nothing else is; unchanged, nothing is new.

One concealed rig of each instrument, through the commands alone; many drawn ones: `python -m benchmarks beside_model`.
"""

import json

import numpy as np
import pytest

from calibeam.cli import run
from tests.support.pairs import Pair, device, laser, laser_line, link, place, seat, tool, unchanged, zero

MOVED_M = np.array([80e-6, -60e-6, 50e-6])
TURNED_RAD = np.array([1.5e-4, 1e-4, -2e-4])
MOVED_DEVICE = device(np.array([1e-3, 2e-3, -1e-3]), np.array([1e-3, 0.0, 2e-3]))
LENGTH, TWIST = (np.array([1.5e-4, 0, 0, 0, 0, 0]), np.array([0, 0, 0, 2e-4, 0, 0]))
SEED = 5101


def shifts(owner, names=("x", "y", "z"), by=MOVED_M):
    return {f"{owner}.{name}": value for name, value in zip(names, by, strict=True)}


def stationed(k, shift_m, turn_rad):
    """The six numbers of a station."""
    names = [f"{what}_{axis}_{unit}" for what, unit in (("shift", "m"), ("turn", "rad")) for axis in "xyz"]
    return shifts(f"placement{k}", names, np.concatenate([shift_m, turn_rad]))


def station_turned(pair, k):
    """About its own origin, as the rig file has it."""
    return place(k, np.zeros(3), TURNED_RAD, pair.case.drawn.nominal.instrument.places[k - 1][:3, 3])


def laser_numbers(pair, change):
    """Of the laser's line, before and after."""
    drawn = pair.case.drawn
    before, after = (laser_line(drawn.nominal.instrument, r.instrument) for r in (drawn.true, change(drawn.true)))
    return shifts("laser", ("shift_u", "shift_v", "tilt_u", "tilt_v"), after - before)


def changes(pair):
    """What is changed -> the change, the physics to name, and its numbers by parameter of model.json."""
    of_all = {"unchanged": (unchanged, "", {})}
    whole = {**of_all, "the device set up elsewhere": (MOVED_DEVICE, "", {})}
    target = {"the target": (tool(MOVED_M), "tool-moved", shifts("tool"))}
    if pair.family == "wire":
        return whole | target
    if pair.family == "cones":
        return of_all | target | {"a cone": (seat(2, MOVED_M), "seat-moved", shifts("seat2"))}
    a_zero = {"a zero": (zero(3, 1.5e-4), "joint-zero-moved", {"joint3.zero": 1.5e-4})}
    if pair.family == "tracker":
        length = {"a length": (link(2, LENGTH), "link-changed", {"link2.length": 1.5e-4})}
        twist = {"a twist": (link(3, TWIST), "link-changed", {"link3.twist": 2e-4})}
        return whole | target | length | twist | a_zero
    moved = laser(MOVED_M, TURNED_RAD)
    return {
        **of_all,
        **a_zero,
        "the fixture at one place": (place(2, MOVED_M), "fixture-moved", stationed(2, MOVED_M, np.zeros(3))),
        "the fixture turned": (station_turned(pair, 1), "fixture-moved", stationed(1, np.zeros(3), TURNED_RAD)),
        "the laser": (moved, "laser-moved", laser_numbers(pair, moved)),
    }


def asked(pair, recording):
    """diagnosis.json of a recording beside the model of the pair."""
    out = recording.with_suffix(".json")
    assert run(["diagnose", str(recording), "--model", str(pair.model), "--out", str(out)]) == 0
    return json.loads(out.read_text())


def judge(found, physics, sizes):
    """Sentences about what is wrong with it; empty: right."""
    named = [f["physics"] for f in found["findings"]]
    if named != ([physics] if physics else []):
        return [f"named {named} instead of {physics or 'nothing'}"]
    by = {c["parameter"]: (c["by"], c["sigma"]) for c in found["changed"]}
    if set(by) != set(sizes):
        return [f"sizes of {', '.join(by)} instead of {', '.join(sizes)}"]
    return [
        f"{name}: {by[name][0]} +- {by[name][1]} instead of {true}"
        for name, true in sizes.items()
        if abs(by[name][0] - true) > 3.0 * by[name][1]
    ]


def judged(pair, what):
    change, physics, sizes = changes(pair)[what]
    return [f"{what}: {one}" for one in judge(asked(pair, pair.later(what.replace(" ", "-"), change)), physics, sizes)]


@pytest.mark.endure
@pytest.mark.parametrize("family", ["tracker", "wire", "cones", "dual-psd"])
def test_each_change_is_named_with_its_size_and_nothing_else(tmp_path, family):
    pair = Pair(tmp_path / "pair", family=family, seed=SEED)
    wrong = [f"own recording: {one}" for one in judge(asked(pair, pair.folder / "recording"), "", {})]
    wrong += [one for what in changes(pair) for one in judged(pair, what)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("family", "samples", "some"),
    [
        ("dual-psd", 100, ("the laser",)),
        pytest.param("dual-psd", 100, ("the fixture turned",), marks=pytest.mark.endure),
        pytest.param("cones", 100, ("a cone",), marks=pytest.mark.endure),
    ],
)
def test_what_stands_around_the_arm_is_named_by_the_parameters_of_the_model(tmp_path, family, samples, some):
    pair = Pair(tmp_path / "pair", family=family, seed=SEED, samples=samples)
    assert [one for what in some for one in judged(pair, what)] == []
