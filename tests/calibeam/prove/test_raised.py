"""Troubles that were met on real robots: each in turn, hidden as it is named, and nothing else than that."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.prove.raised import TROUBLES
from calibeam.prove.scenario import Mix, Scenario, scenario
from simulators.arm.kinematics import forward
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import Made, columns, made, over_noise_of, pair_of, truth_document
from simulators.conceal.rig_file import rig_document
from simulators.conceal.wanted import ConcealError

COUNT = len(TROUBLES)


def _drawn(trouble: str) -> tuple[Scenario, Case]:
    mix = Mix(kinds=("raised",), mechanism=trouble)
    for attempt in range(20):
        one = scenario(mix, 2, 0, attempt)
        try:
            case = conceal(one.wanted)
            if one.wanted.beside is None or case.drawn.drawing.rows:
                return one, case
        except ConcealError:
            continue
    raise AssertionError(f"{trouble}: no draw gave a session")


def test_each_trouble_has_its_turn_and_a_family_that_can_show_it() -> None:
    drawn = [scenario(Mix(kinds=("raised",)), 1, number, 0) for number in range(2 * COUNT)]
    assert [one.trouble for one in drawn] == [*TROUBLES, *TROUBLES]
    assert all(one.wanted.family in TROUBLES[one.trouble].defects for one in drawn)


def test_a_family_that_cannot_show_a_trouble_gives_way() -> None:
    one = scenario(Mix(kinds=("raised",), families=("wire",), mechanism="detector-local-defect"), 1, 0, 0)
    assert one.wanted.family == "dual-psd"


@pytest.mark.parametrize(
    ("trouble", "physics", "ports"),
    [
        ("detector-local-defect", "psd-local-defect", ("psd",)),
        ("fixture-knocked", "moved", ("fixture*", "seat*")),
        ("load-hysteresis", "load-hysteresis", ("joint",)),
        ("lagging-temperature", "link-thermal-growth", ("link",)),
        ("one-sided-stiffness", "joint-compliance", ("joint",)),
        ("wrong-load-centre", "load-centre", ("joint",)),
        ("temporary-shift", "moved", ("base", "laser")),
        ("confused-convention", "rig-convention", ("arm.model",)),
    ],
)
def test_the_seal_holds_the_place_and_the_name_that_count(trouble: str, physics: str, ports: tuple[str, ...]) -> None:
    [hidden] = truth_document(_drawn(trouble)[1])["defects"]
    assert hidden["physics"].endswith(physics)
    assert hidden["port"].startswith(ports)
    assert hidden["enr"] > 0.0


def test_two_soft_joints_are_two() -> None:
    _, case = _drawn("two-soft-joints-second-encoders")
    assert {one.defect.KIND for one in case.hidden} == {"soft-joint"}
    assert len({one.defect.port for one in case.hidden}) == 2
    assert "enc1_rad" in columns(case)


def test_a_thermometer_drifts_and_moves_nothing() -> None:
    one, case = _drawn("room-temperature")
    still = conceal(replace(one.wanted, thermometer_k=0.0))
    assert not case.hidden
    np.testing.assert_array_equal(case.exact.values_m, still.exact.values_m)
    room_degC = case.table.scene.temperature_degC["room"]
    assert (room_degC - still.table.scene.temperature_degC["room"])[-1] == pytest.approx(one.wanted.thermometer_k)
    assert np.std(np.array(columns(case)["temp_room_degC"]) - room_degC) < 0.1


def test_a_column_that_would_name_the_cause_is_missing() -> None:
    _, case = _drawn("missing-column")
    assert case.withheld
    assert not set(case.withheld) & set(columns(case))


def test_a_confused_rig_file_holds_the_numbers_of_its_table_under_the_other_name() -> None:
    _, case = _drawn("confused-convention")
    stated = rig_document(case.stated)["arm"]["model"]
    assert stated == {"irb120": "mdh", "large": "mdh", "ur5": "dh"}[case.drawn.drawing.name]


def test_a_recording_states_a_load_centre_that_is_at_another_place() -> None:
    _, case = _drawn("wrong-load-centre")
    stated_m = np.array([columns(case)[f"payload_com_{axis}_m"][0] for axis in "xyz"], dtype=np.float64)
    assert 0.08 <= float(np.linalg.norm(stated_m - case.table.scene.payload_com_m)) <= 0.2
    assert np.ptp(case.table.scene.payload_kg) > 0.0


@pytest.mark.parametrize("trouble", ["simulation-has-too-much", "geometry-off"])
def test_a_pair_is_of_one_plan_and_nothing_of_the_truth_is_in_it(trouble: str) -> None:
    _, case = _drawn(trouble)
    measured, simulated = pair_of(case)
    np.testing.assert_array_equal(measured.reading_rad, simulated.reading_rad)
    assert columns(measured).keys() == columns(simulated).keys()
    assert rig_document(measured.stated) == rig_document(simulated.stated)
    nominal = measured.drawn.nominal.arm
    np.testing.assert_array_equal(simulated.drawn.true.arm.fixed, nominal.fixed)
    assert measured.off
    assert not simulated.off


def test_only_the_simulation_has_what_is_too_much() -> None:
    _, case = _drawn("simulation-has-too-much")
    measured, simulated = pair_of(case)
    bare = made(case, Made({}), 1)
    np.testing.assert_array_equal(made(case, Made(measured.off), 1).exact.values_m, measured.exact.values_m)
    assert np.std(simulated.exact.values_m - bare.exact.values_m) > case.sigma_m


def test_a_constant_counts_by_what_no_other_constant_can_do() -> None:
    _, case = _drawn("geometry-off")
    two = {"joint1.zero": 1e-3, "joint3.zero": 1e-3}
    enr = over_noise_of(made(case, Made(two), 1))
    assert enr["joint1.zero"] == pytest.approx(0.0, abs=1e-3)  # the device may stand elsewhere instead
    assert enr["joint3.zero"] > 0.6
    half = over_noise_of(made(case, Made({"joint3.zero": 5e-4}), 1))
    assert half["joint3.zero"] == pytest.approx(0.5 * enr["joint3.zero"], rel=1e-6)


def test_three_targets_are_read_in_turn_and_a_repeat_is_of_one() -> None:
    _, case = _drawn("three-targets")
    assert case.target is not None
    np.testing.assert_array_equal(np.unique(case.target), [1, 2, 3])
    for group in range(1, int(case.table.repeat.max()) + 1):
        assert np.unique(case.target[case.table.repeat == group]).size == 1
    document = rig_document(case.stated)
    assert "point_m" not in document["tool"]
    stated_m = np.array([one["point_m"] for one in document["target"]])
    off_m = case.drawn.true.tool_point_m - stated_m[case.target - 1]
    assert 0.0 < np.abs(off_m).max() < 5e-3


def test_few_rows_are_few_and_their_cause_is_plain() -> None:
    one, case = _drawn("few-rows")
    assert 16 <= len(case.reading_rad) == one.wanted.samples < 20
    assert not case.table.repeat.any()
    assert case.hidden[0].enr >= one.wanted.at_least > 5.5


def test_a_six_d_target_turns_with_the_flange() -> None:
    _, case = _drawn("six-d-target")
    assert case.turn_rad is not None
    seen = Rotation.from_rotvec(case.turn_rad)
    arm = case.drawn.true.arm
    flange = Rotation.from_matrix(forward(arm, case.reading_rad + arm.zero_rad).flange[:, :3, :3])
    steps = (seen[1:].inv() * seen[:-1]).magnitude(), (flange[1:].inv() * flange[:-1]).magnitude()
    np.testing.assert_allclose(*steps, atol=2e-3)  # noise and the mechanism
    assert {"rx_rad", "ry_rad", "rz_rad"} <= columns(case).keys()
