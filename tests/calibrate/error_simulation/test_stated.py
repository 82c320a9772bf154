"""Which errors an arm has: what its rig believes, what a file states, and one clear sentence where that is wrong."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.error_simulation.error_plan import (
    ErrorPlan,
    SourceEntry,
    read_error_plan,
    sources_of,
)
from calibrate.error_simulation.machine import machine_of
from calibrate.errors import DataError
from tests.calibrate.error_simulation.conftest import RIGS


@pytest.fixture
def robot():
    return load_rig(RIGS / "ur5e-dual-psd.toml")


def test_a_rig_states_links_zeros_and_reading_noise_by_itself(robot):
    sources = {source.name: source.law for source in sources_of(machine_of(robot), robot)}
    assert sources["link2.x"].scale == robot.tolerance.length_m
    assert sources["joint4.zero"].scale == robot.tolerance.angle_rad
    assert sources["joint1.noise"].scale == robot.noise.joint_rad
    assert not any(name.startswith("heat") for name in sources)


def test_encoder_counts_are_a_quantisation_of_half_a_count(robot):
    joints = tuple(msgspec.structs.replace(joint, encoder_counts=2**17) for joint in robot.arm.joints)
    rig = msgspec.structs.replace(robot, arm=msgspec.structs.replace(robot.arm, joints=joints))
    law = {s.name: s.law for s in sources_of(machine_of(rig), rig)}["joint2.quantisation"]
    assert (law.name, law.scale) == ("uniform", np.pi / 2**17)


def test_an_identified_arm_has_no_longer_the_errors_of_its_drawing(robot):
    names = [source.name for source in sources_of(machine_of(robot), robot, identified=True)]
    assert names == [f"joint{i}.noise" for i in range(1, 7)]


def test_only_what_was_asked_for_is_perturbed(robot):
    names = [source.name for source in sources_of(machine_of(robot), robot, only=("link2.*", "joint1.zero"))]
    assert names == [*(f"link2.{axis}" for axis in ("x", "y", "z", "roll", "pitch", "yaw")), "joint1.zero"]


def test_a_later_entry_wins(rig, machine):
    entries = (SourceEntry(("link*.x",), scale_m=1.0), SourceEntry(("link3.x",), scale_m=2.0))
    sources = sources_of(machine, rig, ErrorPlan(1, entries, believed=False))
    assert [source.law.scale for source in sources] == [1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        (SourceEntry(("lnk2.x",), scale_m=1.0), "did you mean 'link2.x'"),
        (SourceEntry(("link2.x",), scale_rad=1.0), "this error is in m"),
        (SourceEntry(("heat.arm",), scale_k=1.0), "expansion_per_k"),
        (SourceEntry(("link2.x",), scale_m=1.0, order=2.0), "no order"),
        (SourceEntry(("link2.x",), scale_m=0.0), "no error to simulate"),
    ],
)
def test_what_cannot_be_is_refused_by_name(rig, machine, entry, says):
    with pytest.raises(DataError, match=says):
        sources_of(machine, rig, ErrorPlan(1, (entry,), believed=False))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("schema = 1\n[[source]]\nwhat = ['link2.x']\nscale = 1", "line 4.*scale"),
        ("schema = 1\n[[source]]\nwhat = ['link2.x']", "line 2: a source wants one of"),
        ("schema = 1\n[[source]]\nwhat = ['link2.x']\nlaw = 'cauchy'\nscale_m = 1e-5", "line 2.*no variance"),
        (
            "schema = 1\n[[source]]\nwhat = ['joint1.zero']\nscale_rad = 1e-5\nloc_m = 0.001",
            "line 5: loc_m .*give loc_rad",
        ),
        ("schema = 1\nsource = [", "not TOML"),
    ],
)
def test_a_fault_of_the_file_is_named_with_its_line(tmp_path, text, says):
    path = tmp_path / "errors.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=f"errors.toml.*{says}"):
        read_error_plan(path)


def test_the_shipped_errors_fit_the_reference_arm(rig, machine):
    sources = sources_of(machine, rig, read_error_plan(RIGS / "errors" / "arm-cmm.toml"))
    assert {source.group for source in sources} >= {"link lengths", "quantisation", "joint runout", "heat"}
