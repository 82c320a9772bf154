"""Before a session with one target: what it leaves open of other tools."""

from pathlib import Path

import pytest

from acquisition.recording.rig import parse_rig
from calibeam.rig_files import of_one_point

RIGS = Path(__file__).parents[2] / "rigs"
TARGETS = "".join(f"\n[[target]]\nid = {k}\npoint_m = [0.0, 0.0, 0.{k}]\npoint_sigma_m = 2e-5\n" for k in (1, 2, 3))


@pytest.mark.parametrize(
    ("rig", "more", "open_"),
    [
        ("ur5e-tracker", "", True),
        ("ur5e-tracker", TARGETS, False),
        ("ur5e-dual-psd", "", False),
        ("arm-cmm-reference", "", False),
    ],
)
def test_one_target_does_not_show_how_the_flange_is_turned(rig, more, open_):
    text = (RIGS / f"{rig}.toml").read_text(encoding="utf-8")
    assert bool(of_one_point(parse_rig(text + more, "rig.toml"))) == open_
