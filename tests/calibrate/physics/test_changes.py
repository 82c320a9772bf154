"""What a site changes between two recordings is named with its size, and nothing else is; unchanged, nothing is new.

One concealed rig of each instrument, through the commands alone.
"""

import json

import numpy as np
import pytest

from calibeam.cli import run
from tests.support.pairs import Pair, device, laser, link, place, seat, tool, unchanged, zero

MOVED_M = np.array([80e-6, -60e-6, 50e-6])
ELSEWHERE = device(np.array([1e-3, 2e-3, -1e-3]), np.array([1e-3, 0.0, 2e-3]))
LENGTH, TWIST = (np.array([1.5e-4, 0, 0, 0, 0, 0]), np.array([0, 0, 0, 2e-4, 0, 0]))
NOTHING: tuple[str, tuple[float, ...]] = ("", ())
# What is changed -> the physics to name, and its numbers in the order of `changed`.
TRACKER = {
    "unchanged": (unchanged, NOTHING),
    "the tracker set up elsewhere": (ELSEWHERE, NOTHING),
    "the target": (tool(MOVED_M), ("tool-moved", tuple(MOVED_M))),
    "a length": (link(2, LENGTH), ("link-changed", (1.5e-4,))),
    "a twist": (link(3, TWIST), ("link-changed", (2e-4,))),
    "a zero": (zero(3, 1.5e-4), ("joint-zero-moved", (1.5e-4,))),
}
CHANGES = {
    "tracker": TRACKER,
    "wire": {k: TRACKER[k] for k in ("unchanged", "the tracker set up elsewhere", "the target")},
    "cones": {
        "unchanged": (unchanged, NOTHING),
        "a cone": (seat(2, MOVED_M), ("seat-moved", tuple(MOVED_M))),
        "the probe": (tool(MOVED_M), ("tool-moved", tuple(MOVED_M))),
    },
    "dual-psd": {
        "unchanged": (unchanged, NOTHING),
        "the fixture at one place": (place(2, MOVED_M), ("fixture-moved", (*MOVED_M, 0.0, 0.0, 0.0))),
        "the laser": (
            laser(MOVED_M, np.zeros(3)),
            ("laser-moved", ()),
        ),  # along and about the beam nobody sees it: no number alone
        "a zero": (zero(3, 1.5e-4), ("joint-zero-moved", (1.5e-4,))),
    },
}
SEED = 5101


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
    if len(by) != len(sizes):
        return [f"{len(by)} sizes instead of {len(sizes)}"]
    return [
        f"{name}: {value} +- {sigma} instead of {true}"
        for (name, (value, sigma)), true in zip(by.items(), sizes, strict=True)
        if abs(value - true) > 3.0 * sigma
    ]


@pytest.mark.endure
@pytest.mark.parametrize("family", CHANGES)
def test_each_change_is_named_with_its_size_and_nothing_else(tmp_path, family):
    pair = Pair(tmp_path / "pair", family=family, seed=SEED)
    wrong = [f"own recording: {one}" for one in judge(asked(pair, pair.folder / "recording"), *NOTHING)]
    for what, (change, (physics, sizes)) in CHANGES[family].items():
        told = judge(asked(pair, pair.later(what.replace(" ", "-"), change)), physics, sizes)
        wrong += [f"{what}: {one}" for one in told]
    assert not wrong, "\n".join(wrong)
