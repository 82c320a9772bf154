"""What every device with a line of its own does alike, on a line that keeps a book."""

import pytest

from drivers.device import StreamDevice
from drivers.errors import DeviceLost, DeviceRefused


class Line:
    def __init__(self):
        self.released = 0


class Booked(StreamDevice[Line]):
    """`meanwhile` is called while the stream is set up, as another thread may do anything then."""

    def __init__(self, meanwhile):
        super().__init__("booked", None)
        self.lines, self._meanwhile = [], meanwhile

    def _open(self):
        self.lines.append(Line())
        return self.lines[-1]

    def _set_up(self, line):
        self._meanwhile(self)

    def _release(self, line):
        line.released += 1


def test_a_device_that_is_closed_while_it_is_set_up_is_not_connected_and_keeps_no_line():
    device = Booked(lambda it: it.close())
    with pytest.raises(DeviceLost, match="booked: closed while it was being connected"):
        device.connect()
    assert device.lines[0].released > 0
    with pytest.raises(DeviceLost, match="not connected"):
        device._opened()


def test_a_set_up_that_fails_leaves_no_line_open():
    def refuse(device):
        raise DeviceRefused("booked: no")

    device = Booked(refuse)
    with pytest.raises(DeviceRefused):
        device.connect()
    assert [line.released for line in device.lines] == [1]


def test_connecting_anew_releases_the_line_before():
    device = Booked(lambda it: None)
    device.connect()
    device.connect()
    assert [line.released for line in device.lines] == [1, 0]
    device.close()
    device.close()
    assert [line.released for line in device.lines] == [1, 1]
