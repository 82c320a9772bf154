"""When a look may begin: what the PSD box's clock shows once the arm stands, or later, never earlier."""

from typing import cast

import numpy as np
import pytest

from acquisition.wires.bench import LATENESS_S, device_time
from acquisition.wires.streams import Pump
from drivers.device import Block

FRAME_S = 0.01  # of device time


class Arrived:
    """A PSD box whose clock runs at `pace` of this program's, each frame taken `late_s` (host) after its end."""

    def __init__(self, pace: float, late_s: float = 0.001) -> None:
        self.host_s = 100.0
        device_s = np.arange(0.0, 400.0, FRAME_S)
        self.now_device_s = device_s[-1] + late_s * pace
        arrived_s = self.host_s + (device_s - self.now_device_s) / pace + late_s
        none = np.empty(0, dtype=np.int64)
        self._blocks = [Block(arrived_s[[i]], device_s[[i]], none, {}) for i in range(len(device_s))]

    def recent(self, after_host_s: float) -> list[Block]:
        return [block for block in self._blocks if block.host_s[-1] > after_host_s]


@pytest.mark.parametrize("hurry", [1.0, 8.0])
def test_a_device_that_keeps_its_pace_is_known_to_the_lateness_of_its_frames(hurry: float) -> None:
    box = Arrived(pace=hurry)
    assert device_time(cast(Pump, box), box.host_s, hurry) == pytest.approx(box.now_device_s, abs=1e-3 * hurry + 1e-6)


@pytest.mark.parametrize("hurry", [2.0, 8.0])
def test_an_emulator_that_falls_behind_is_waited_for_as_long_as_it_lost_in_two_of_its_seconds(hurry: float) -> None:
    box = Arrived(pace=0.8 * hurry)
    ahead_s = device_time(cast(Pump, box), box.host_s, hurry) - box.now_device_s
    assert 0.0 < ahead_s < 0.25 * LATENESS_S
