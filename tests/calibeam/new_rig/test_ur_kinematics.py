"""The factory calibration of a UR becomes its rig: frames of the YAML, multiplied out, are those of the rig."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Make, load_rig, parse_rig, rig_text
from calibeam.cli import run
from calibeam.commands.rig import shipped_rigs
from calibrate.apply.export.export import export_text, form_named
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.rig_arm import RigArm

BODIES = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
NUMBERS = (  # a UR5e that is off its data sheet
    (0.0, 0.0, 0.16254, -0.0, 0.0, 2e-5),
    (1.1e-4, 0.0, 0.0, 1.5712, 0.0, -3e-5),
    (-0.42511, 0.0, 0.0, 3.1e-4, -2.2e-4, 1e-5),
    (-0.39218, 2.7e-4, 0.13312, 3.1411, -3.14109, -3.14155),
    (4e-5, -0.09971, 1.3e-4, 1.5721, 0.0, -1e-5),
    (-6e-5, 0.09957, -2.1e-5, 1.5710, 3.14159, 3.14158),
)
BLOCKS = "kinematics:\n" + "".join(
    f"  {body}:\n" + "".join(f"    {key}: {value!r}\n" for key, value in zip(KEYS, row, strict=True))
    for body, row in zip(BODIES, NUMBERS, strict=True)
) + "  hash: calib_12788084448423163542\n"  # fmt: skip
BRACES = "kinematics:\n" + "".join(
    f"  {body}: {{{', '.join(f'{key}: {value!r}' for key, value in zip(KEYS, row, strict=True))}}}\n"
    for body, row in zip(BODIES, NUMBERS, strict=True)
)
Q = np.random.default_rng(5).uniform(-2.0, 2.0, (10, 6))


def made(tmp_path, text):
    path, out = tmp_path / "calibration.yaml", tmp_path / "rig.toml"
    path.write_text(text)
    return run(["rig", "new", "--from-ur-kinematics", str(path), "--out", str(out)]), out


def flange(q):
    """URDF: x, y, z first, then Rz(yaw) Ry(pitch) Rx(roll), then the turn of the joint about its z."""
    T = np.eye(4)
    for row, turn in zip(NUMBERS, q, strict=True):
        step = np.eye(4)
        roll, pitch, yaw = (
            Rotation.from_rotvec(a * axis).as_matrix() for a, axis in zip(row[3:], np.eye(3), strict=True)
        )
        step[:3, 3], step[:3, :3] = row[:3], yaw @ pitch @ roll @ Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
        T = T @ step
    return T


@pytest.mark.parametrize("text", [BLOCKS, BRACES], ids=["blocks", "braces"])
def test_the_rig_stands_where_the_factory_has_the_arm(tmp_path, text):
    done, out = made(tmp_path, text)
    rig = load_rig(out)
    assert done == 0
    assert rig.arm.make is Make.UR
    np.testing.assert_allclose(RigArm.of_rig(rig).frames(Q)[:, -1], [flange(q) for q in Q], atol=1e-12)
    assert ("calib_12788084448423163542" in out.read_text()) == (text is BLOCKS)
    assert rig.arm.joints[2].upper_rad == pytest.approx(np.pi)


def test_what_export_writes_is_read_back(tmp_path):
    rig = parse_rig(rig_text(shipped_rigs()["ur5e"]), "rig.toml")
    rng = np.random.default_rng(3)
    wrong = {p.name: float(rng.normal(0.0, 1e-3)) for p in arm_of(rig).parameters}
    done, out = made(tmp_path, export_text(rig, wrong, form_named("ur-kinematics")))
    assert done == 0
    there = RigArm.of_rig(rig, wrong).frames(Q)[:, -1]
    np.testing.assert_allclose(RigArm.of_rig(load_rig(out)).frames(Q)[:, -1], there, atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("  wrist_3:", "  wrist_4:", "wrist_3: x is missing"),
        ("    roll: 1.5712\n", "", "upper_arm: roll is missing"),
        ("x: -0.42511", "x: long", "forearm: "),
        ("z: 0.13312", "z: .nan", "wrist_1: "),
    ],
)
def test_a_file_that_is_not_whole_is_refused_with_body_and_key(tmp_path, capsys, old, new, says):
    done, out = made(tmp_path, BLOCKS.replace(old, new, 1))
    assert done == 1
    assert f"calibration.yaml: {says}" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
