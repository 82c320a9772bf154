"""Drawings that ask for memory without end: refused by what they state, before a loader makes it."""

from pathlib import Path

import pytest

from calibeam.new_rig.from_mjcf import mjcf_arm
from calibeam.new_rig.from_urdf import urdf_arm
from calibrate.errors import DataError
from tests.calibeam.mutations.inputs import MJCF, URDF

ASSET = '<asset><{} name="a" {}/></asset>'
BEHIND = "</body></body></body></worldbody>"


def _drawing(folder: Path, before: str = "", inside: str = "") -> Path:
    path = folder / "arm.xml"
    path.write_text(MJCF.replace("<worldbody>", before + "<worldbody>").replace(BEHIND, inside + BEHIND), "utf-8")
    return path


@pytest.mark.parametrize(
    ("before", "inside", "lines"),
    [
        ('<size nuserdata="400000000"/>', "", r'<size nuserdata="400000000">: at most 10000000 are read; make it smal'),
        ('<size memory="8G"/>', "", r"<size memory>: more than 4 GB; make it smaller"),
        (ASSET.format("hfield", 'nrow="20000" ncol="20000" size="1 1 1 1"'), "", r'<hfield nrow="20000" ncol="20000"'),
        (ASSET.format("texture", 'type="2d" builtin="flat" width="9999" height="9999"'), "", r"<texture type"),
        ("", '<replicate count="30000"><geom size="1"/></replicate>', r'<replicate count="30000">: at most 20000'),
        ("", '<replicate count="300"><replicate count="300"><geom size="1"/></replicate></replicate>', "20000 parts"),
        ("", '<flexcomp type="grid" count="300 300 300" spacing="1 1 1"/>', r"<flexcomp .*at most 20000"),
        ("", '<geom size="1"/>' * 20_001, "more than 20000 parts, replicated ones counted; give the arm alone"),
        ('<size nuserdata="many"/>', "", r"<size nuserdata=many>: no whole number; correct it"),
        ('<include file="arm.xml"/>', "", r"files include each other more than 8 deep; write one file"),
        ("<!DOCTYPE a>", "", "DOCTYPE is refused: no MJCF file needs a document type"),
    ],
)
def test_sizes_of_mjcf_are_asked_before_it_is_loaded(
    before: str, inside: str, lines: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mujoco.MjModel", None)
    with pytest.raises(DataError, match=rf"arm\.xml: .*{lines}"):
        mjcf_arm(_drawing(tmp_path, before, inside), tip="tip")


def test_sizes_that_an_arm_has_are_taken(tmp_path: Path) -> None:
    before = '<size memory="1G"/>' + ASSET.format("texture", 'type="2d" builtin="flat" width="4096" height="4096"')
    inside = '<replicate count="4" offset="0 0 1"><geom size="0.1" mass="0"/></replicate>'
    assert len(mjcf_arm(_drawing(tmp_path, before, inside), tip="tip").joints) == 2


def test_a_urdf_of_more_joints_than_a_robot_has_is_refused(tmp_path: Path) -> None:
    joint = '<link name="l{0}"/><joint name="j{0}" type="fixed"><parent link="tip"/><child link="l{0}"/></joint>'
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.replace("</robot>", "".join(joint.format(k) for k in range(999)) + "</robot>"), "utf-8")
    with pytest.raises(DataError, match=r"arm\.urdf: 1001 joints; at most 1000 are read, give the part of the robot"):
        urdf_arm(path)
