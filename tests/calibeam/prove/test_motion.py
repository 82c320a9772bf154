"""The concealed proof of torques: cases that are asked for, recorded, diagnosed blindly and scored."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from acquisition.recording import read
from calibeam.prove.motion_recording import record_motion
from calibeam.prove.prove import Plan, prove
from calibeam.prove.record import CaseScore, DefectScore, NamedCause
from calibeam.prove.scenario import Mix, scenario, wired_scenario
from calibeam.prove.scoring import PASSED, torque_over_noise
from calibeam.prove.seal import Layout
from calibeam.prove.tally import by_motion, faults, of_motion
from calibrate.diagnose.record.schema import DiagnosisFile, JointTorqueRecord, TorquesRecord
from simulators.conceal.wanted import Wanted

MOTION = Mix(kinds=("motion",))


def test_motions_are_of_each_arm_in_turn_with_none_to_three_hidden_and_only_when_asked_for() -> None:
    drawn = [scenario(MOTION, 1, number, 0) for number in range(60)]
    assert {one.wanted.arm for one in drawn[:3]} == {"ur5e", "kr6", "iiwa7"}
    assert {len(one.wanted.defects) for one in drawn} == {0, 1, 2, 3}
    assert any(one.wanted.defects == ("outside",) for one in drawn)
    assert not any(scenario(Mix(), 1, number, 0).kind == "motion" for number in range(60))


def test_a_motion_on_wires_is_of_the_emulated_arm_and_other_proofs_keep_their_sessions() -> None:
    one = wired_scenario(MOTION, 1, 60, 0)
    assert (one.kind, one.path, one.wanted.arm) == ("motion", "on wires", "ur5e")
    assert wired_scenario(Mix(), 1, 60, 0).kind == "one"


def test_a_recording_holds_the_motion_and_nothing_of_what_is_hidden(tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    truth = record_motion(Wanted("tracker", seed=11, arm="kr6", defects=("coulomb",)), path)
    recording = read(path)
    assert set(recording.streams["robot"].values) == {"target_q_rad", "actual_q_rad", "joint_torque_nm"}
    assert len(recording.streams["robot"].host_s) == 10_000
    assert recording.rig.emulation is None
    assert "coulomb" not in recording.rig_text
    assert [d["mechanism"] for d in truth["defects"]] == ["coulomb"]


def test_two_motions_are_sealed_diagnosed_and_scored(tmp_path: Path) -> None:
    lines: list[str] = []
    plan = Plan(Mix(kinds=("motion",), mechanism="coulomb"), seed=3, cases=2, jobs=2)
    proof = prove(tmp_path / "proof", plan, lines.append, "calibeam prove")
    layout = Layout(tmp_path / "proof")
    assert any("SHA-256" in line for line in lines)
    for case in proof.cases:
        hidden = json.loads(layout.revealed(case.name).read_text(encoding="utf-8"))["defects"]
        assert not case.error
        assert [d.port for d in case.defects] == [d["port"] for d in hidden]
        assert case.defects[0].named
        assert case.torque_over_noise is not None
        assert 0.8 < case.torque_over_noise < 2.0
    assert "Torques of recorded motions" in layout.page.read_text(encoding="utf-8")


def test_unseen_torque_counts_in_the_noise_that_the_low_pass_lets_through() -> None:
    joints = tuple(
        JointTorqueRecord(j, 500, 10.0, 0.1, 1.0, left) for j, left in ((1, 0.3 * PASSED), (2, 0.2 * PASSED))
    )
    file = DiagnosisFile(
        schema=1,
        verdict="consistent",
        noise_floor_m=None,
        rms_before_m=None,
        rms_after_m=None,
        findings=(),
        unexplained=None,
        next=(),
        torques=TorquesRecord("", joints),
    )
    assert torque_over_noise(file, (0.3, 0.1)) == pytest.approx(2.5**0.5)  # of 1 and 2


def test_motions_are_counted_by_what_can_be_seen_and_by_what_is_reported_of_nothing(
    case: Callable[..., CaseScore], found: Callable[..., DefectScore]
) -> None:
    other = NamedCause("joint5.torque", "q5", "joint-spring", 0.95, "", placed=False, right=False)
    seen, faint = found(physics="coulomb-friction", enr=2.0), found(physics="torque-delay", enr=0.2, located=False)
    ones = [
        case((seen, faint), (other,), kind="motion", family="kr6", torque_over_noise=1.1),
        case((), (), kind="motion", family="ur5e", torque_over_noise=1.0),
    ]
    first, below, *rest = by_motion(ones)
    assert (first.located.k, first.located.n, first.spurious) == (1, 1, 0.5)
    assert (below.located.k, below.located.n) == (0, 1)
    assert {line.label for line in rest} == {"kr6", "ur5e", "in process", "coulomb-friction"}
    values = {figure.label: figure.said for figure in of_motion(ones)}
    assert values["motion: unseen torque over noise, median and p90"].startswith("1.05")
    assert of_motion([]) == []
    assert faults(ones[0]) == ["misnamed with confidence: joint-spring at joint5.torque"]
