"""Before a session with one target: what it leaves open of other tools."""

from pathlib import Path

import pytest

from acquisition.recording.rig import parse_rig
from calibeam.rig_files import of_one_point, rig_path
from calibrate.errors import DataError

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


def test_a_shipped_rig_is_found_by_its_name_or_its_robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert rig_path(Path("ur5e")).name == "ur5e-tracker.toml"
    assert rig_path(Path("ur5e-dual-psd")).is_file()
    assert rig_path(Path("mine.toml")) == Path("mine.toml")
    with pytest.raises(DataError, match="irb120-modbus"):
        rig_path(Path("ur55"))
    (tmp_path / "irb120").mkdir()  # a folder is no rig file
    assert rig_path(Path("irb120")).name == "irb120-modbus.toml"
    (tmp_path / "ur5e").write_text("")
    assert rig_path(Path("ur5e")) == Path("ur5e")  # a file of the user's own comes first
