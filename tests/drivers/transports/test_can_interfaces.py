"""Every CAN adapter by its name: opened, or lost for a stated reason; never anything else."""

import gc
import warnings
from types import SimpleNamespace

import can
import pytest

from drivers.errors import DeviceLost
from drivers.transports.can_bus import MOST_AT_ONCE, bus_opener, interfaces, opened, received


@pytest.mark.parametrize("interface", [name for name in interfaces() if name != "udp_multicast"])
@pytest.mark.filterwarnings("ignore")  # what vendors' libraries say when they are missing is not ours to mend
def test_every_interface_opens_or_is_lost(interface):
    open_bus = bus_opener(interface, "0", 500_000)
    if interface == "virtual":
        opened(open_bus, "encoders").shutdown()
        return
    with pytest.raises(DeviceLost, match="encoders: the CAN bus cannot be opened") as lost:
        opened(open_bus, "encoders")  # no test machine has such an adapter under this name
    assert lost.value.__cause__ is not None
    del lost
    leave_no_trace()


def leave_no_trace() -> None:
    """What a vendor's half-opened bus holds is freed here, so that its complaint belongs to no other test."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.mark.parametrize(
    ("interface", "says"),
    [
        ("socketcann", r"unknown interface 'socketcann'; did you mean 'socketcand?'"),
        ("zzz", "known are .*pcan"),
        ("udp_multicast", "loses frames"),
    ],
)
def test_a_name_that_cannot_be_used_says_what_can(interface, says):
    with pytest.raises(DeviceLost, match=says):
        opened(bus_opener(interface, "0", 500_000), "encoders")


def test_options_are_python_cans_own_words():
    with pytest.raises(DeviceLost, match="host") as missing:  # socketcand wants host and port
        opened(bus_opener("socketcand", "can0", 500_000), "encoders")
    assert isinstance(missing.value.__cause__, TypeError)
    bus = opened(bus_opener("virtual", "echo", 500_000, {"receive_own_messages": True}), "encoders")
    bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))
    heard = bus.recv(0.0)
    assert heard is not None
    assert heard.arbitration_id == 0x123
    bus.shutdown()


def test_a_serial_adapter_is_looked_up_at_every_opening(tmp_path):
    plugs = [SimpleNamespace(device=str(tmp_path / "first"), serial_number="A1")]
    open_bus = bus_opener("slcan", "", 500_000, serial_number="A1", ports=lambda: plugs)
    with pytest.raises(DeviceLost, match="first"):
        opened(open_bus, "encoders")
    plugs[0].device = str(tmp_path / "second")
    with pytest.raises(DeviceLost, match="second"):
        opened(open_bus, "encoders")
    plugs.clear()
    with pytest.raises(DeviceLost, match="no USB plug with serial number 'A1'"):
        opened(open_bus, "encoders")


def test_all_frames_of_any_bus_are_received_together() -> None:
    with can.Bus("together", interface="virtual") as there, can.Bus("together", interface="virtual") as here:
        for number in range(MOST_AT_ONCE + 2):
            there.send(can.Message(arbitration_id=number, is_extended_id=False))
        assert [message.arbitration_id for message in received(here, 1.0)] == list(range(MOST_AT_ONCE))
        assert len(received(here, 1.0)) == 2
        assert received(here, 0.0) == []


def test_frames_before_the_loss_of_an_adapter_are_kept() -> None:
    class Going(can.BusABC):
        def __init__(self) -> None:
            super().__init__(channel="going")
            self.left = 2

        def recv(self, timeout: float | None = None) -> can.Message | None:
            self.left -= 1
            if self.left < 0:
                raise can.CanOperationError("unplugged")
            return can.Message(arbitration_id=self.left)

        def send(self, msg: can.Message, timeout: float | None = None) -> None: ...

    with Going() as bus:
        assert [message.arbitration_id for message in received(bus, 1.0)] == [1, 0]
        with pytest.raises(can.CanError, match="unplugged"):
            received(bus, 1.0)
