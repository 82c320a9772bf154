"""A belt by its encoder, a part by a file, a hand by an output: each as the samples have it."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from acquisition.errors import TaskError
from acquisition.motion.task.task_file import OUTPUTS, Hand
from calibeam.motion.task_by_hand import recorded_poses
from calibeam.motion.task_devices import EncoderBelt, OutputHand, part_in_file
from drivers.device import Block
from drivers.errors import DeviceLost, DeviceRefused
from drivers.ur.dashboard import UrOutputs


class Clock:
    def __init__(self, t_s: float = 0.0) -> None:
        self.t_s = t_s

    def now_s(self) -> float:
        return self.t_s

    def sleep_s(self, seconds: float) -> None:
        self.t_s += seconds


def turning(begin_s: float, rad_s: float, *, lost: bool = False) -> Block:
    """A tenth of a second of an encoder at 100 Hz."""
    t_s = begin_s + 0.01 * np.arange(10)
    position_rad = rad_s * t_s[:, None]
    if lost:
        position_rad[3:5] = np.nan
    return Block(t_s, t_s, np.arange(10), {"position_rad": position_rad})


def test_a_belt_is_carried_on_from_its_newest_sample_at_its_speed() -> None:
    clock = Clock(0.35)
    belt = EncoderBelt(0.5, clock)  # half a metre a turn
    assert belt.now().s_m == 0.0  # nothing heard yet
    for k in range(4):
        belt.heard(turning(0.1 * k, math.tau, lost=k == 3))
    assert belt.now().rate_m_s == pytest.approx(0.5)
    assert belt.now().s_m == pytest.approx(0.5 * 0.35)
    belt.zero()
    clock.t_s += 0.02
    assert belt.now().s_m == pytest.approx(0.5 * 0.02)


def test_a_belt_that_stops_has_no_speed_left_after_the_time_it_is_averaged_over() -> None:
    clock = Clock(0.7)
    belt = EncoderBelt(-0.5, clock)
    belt.heard(turning(0.0, math.tau))
    for k in range(4, 7):
        belt.heard(
            Block(0.1 * k + 0.01 * np.arange(10), np.zeros(10), np.arange(10), {"position_rad": np.ones((10, 1))})
        )
    assert belt.now().rate_m_s == pytest.approx(0.0, abs=1e-9)
    assert belt.now().s_m == pytest.approx(-0.5 / math.tau)


def test_a_part_in_a_file_is_its_transform(tmp_path: Path) -> None:
    file = tmp_path / "part.toml"
    file.write_text("origin_m = [0.1, 0.02, 0.03]\nrotation_rad = [0.0, 3.141592653589793, 0.0]\n")
    T = part_in_file(file)
    np.testing.assert_allclose(T[:3, 3], [0.1, 0.02, 0.03])
    np.testing.assert_allclose(T[:3, 2], [0.0, 0.0, -1.0], atol=1e-12)
    file.write_text("origin = [1, 2, 3]\n")
    with pytest.raises(TaskError, match=r"part\.toml"):
        part_in_file(file)


class Outputs:
    def __init__(self) -> None:
        self.switched: list[tuple[int, bool]] = []

    def switch(self, bit: int, level: bool) -> None:
        self.switched.append((bit, level))


class Stream:
    """The controller's word of outputs, as it stands in the next blocks."""

    def __init__(self, clock: Clock, words: list[int]) -> None:
        self.clock, self.words, self.block = clock, words, None

    def latest(self) -> Block | None:
        return self.block

    def wait(self, after_s: float, timeout_s: float) -> list[Block]:
        self.clock.t_s += 0.3
        word = self.words.pop(0) if len(self.words) > 1 else self.words[0]
        t_s = np.array([self.clock.t_s])
        self.block = Block(t_s, t_s, np.array([0]), {"digital_outputs": np.array([word])})
        return [self.block]


def hand_on(words: list[int], **hand: Any) -> tuple[OutputHand, Outputs]:
    outputs, clock = Outputs(), Clock()
    robot = SimpleNamespace(clock=clock, pump=Stream(clock, words))
    return OutputHand(Hand(**hand), cast("UrOutputs", outputs), cast("Any", robot)), outputs


def test_a_grip_returns_when_the_controllers_stream_shows_it() -> None:
    hand, outputs = hand_on([0, 1 << 11, 0], output="configurable 3")
    hand.act("GRASP")
    hand.act("RELEASE")
    assert outputs.switched == [(11, True), (11, False)]


def test_a_hand_that_closes_without_voltage_is_switched_off_to_grip() -> None:
    hand, outputs = hand_on([0], output="tool 1", closed=False)
    hand.act("GRASP")
    assert outputs.switched == [(17, False)]
    assert len(OUTPUTS) == 18


def test_an_output_that_does_not_switch_is_an_error_with_its_name() -> None:
    hand, _ = hand_on([0], output="standard 2")
    with pytest.raises(DeviceRefused, match=r"output standard 2.*shows no change within 1 s"):
        hand.act("GRASP")


def test_outputs_that_are_not_there_are_refused() -> None:
    outputs = UrOutputs("127.0.0.2")
    with pytest.raises(ValueError, match="bits 0 to 17"):
        outputs.switch(18, True)
    with pytest.raises(DeviceLost, match="not connected"):
        outputs.switch(0, True)


def test_recorded_poses_by_position_in_either_unit(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    file.write_text("at,q1_deg,q2_rad\nat pin,90,0.5\nin hole 1,-45,1.0\n")
    np.testing.assert_allclose(recorded_poses(file, 2)["at pin"], [math.pi / 2, 0.5])
    file.write_text("at,q1_deg,q2_rad\nat pin,ninety,0.5\n")
    with pytest.raises(TaskError, match=r"poses\.csv, line 2: joint 1 is 'ninety'"):
        recorded_poses(file, 2)
    file.write_text("at,q1_deg,q2_rad\n,1,nan\n")
    with pytest.raises(TaskError, match="2 finite joint readings"):
        recorded_poses(file, 2)
