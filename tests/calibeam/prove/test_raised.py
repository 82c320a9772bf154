"""Troubles that were met on real robots: each in turn, hidden as it is named, and nothing else than that."""

from dataclasses import replace

import numpy as np
import pytest

from calibeam.prove.raised import TROUBLES
from calibeam.prove.scenario import Mix, Scenario, scenario
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import columns, truth_document
from simulators.conceal.rig_file import rig_document
from simulators.conceal.wanted import ConcealError

COUNT = len(TROUBLES)


def _drawn(trouble: str) -> tuple[Scenario, Case]:
    mix = Mix(kinds=("raised",), mechanism=trouble)
    for attempt in range(20):
        one = scenario(mix, 2, 0, attempt)
        try:
            return one, conceal(one.wanted)
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
    stated = rig_document(case.belief)["arm"]["model"]
    assert stated == {"irb120": "mdh", "large": "mdh", "ur5": "dh"}[case.drawn.drawing.name]


def test_a_recording_states_a_load_centre_that_is_elsewhere() -> None:
    _, case = _drawn("wrong-load-centre")
    stated_m = np.array([columns(case)[f"payload_com_{axis}_m"][0] for axis in "xyz"], dtype=np.float64)
    assert 0.08 <= float(np.linalg.norm(stated_m - case.table.scene.payload_com_m)) <= 0.2
    assert np.ptp(case.table.scene.payload_kg) > 0.0
