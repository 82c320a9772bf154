"""A device that is lost is attached again by itself; who waits for it can give up."""

import threading

import numpy as np
import pytest

from acquisition.wires.attaching import Reopening
from drivers.clock import SystemClock
from drivers.device import Block, Channel
from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale

ANGLE = Channel("position_rad", "rad")


class Scripted:
    """Gives what it is told to: a block's number, or an error; and so when it is connected."""

    name = "encoders"

    def __init__(self, reads: list[object], connects: list[object] | None = None) -> None:
        self._reads, self._connects = list(reads), list(connects or [])
        self.channels = (ANGLE,)
        self.serial_number = ""
        self.tried = threading.Event()
        self.closed = 0

    def connect(self) -> None:
        self.tried.set()
        what = self._connects.pop(0) if self._connects else None
        if isinstance(what, DeviceError):
            raise what
        if isinstance(what, Channel):
            self.channels = (what,)
        if isinstance(what, str):
            self.serial_number = what

    def describe(self) -> tuple[Channel, ...]:
        return self.channels

    def read(self, timeout_s: float) -> Block:
        what = self._reads.pop(0)
        if isinstance(what, DeviceError):
            raise what
        number = np.array([what])
        return Block(number * 1.0, number * 1.0, number, {"position_rad": number * 1.0})

    def close(self) -> None:
        self.closed += 1


class Listener:
    def __init__(self) -> None:
        self.lost: list[str] = []
        self.back: list[tuple[float, float]] = []

    def attach(self, device: Scripted) -> Reopening:
        reopening = Reopening(
            device,
            SystemClock(),
            lambda why, _: self.lost.append(str(why)),
            lambda from_s, to_s: self.back.append((from_s, to_s)),
            retry_s=0.0,
            who=lambda: (device.serial_number,),
        )
        reopening.connect()
        return reopening


@pytest.mark.parametrize("why", [DeviceLost("unplugged"), DeviceStale("silent"), DeviceRefused("stopped by another")])
def test_a_lost_device_is_attached_again_and_the_stretch_reported(why: DeviceError) -> None:
    listener = Listener()
    device = listener.attach(Scripted([1, why, 2], [None, DeviceLost("still away"), DeviceStale("still away"), None]))
    assert device.read(0.1).sequence.tolist() == [1]
    assert device.read(0.1).sequence.tolist() == [2]
    assert listener.lost == [str(why)]
    ((from_s, to_s),) = listener.back
    assert to_s >= from_s


def test_at_the_start_it_must_be_there() -> None:
    with pytest.raises(DeviceLost, match="no adapter"):
        Listener().attach(Scripted([], [DeviceLost("no adapter")]))


def test_another_device_in_its_place_is_refused() -> None:
    device = Listener().attach(Scripted([DeviceLost("unplugged")], [None, Channel("position_rad", "rad", (3,))]))
    with pytest.raises(DeviceRefused, match="came back as another device"):
        device.read(0.1)


def test_another_one_of_the_same_type_is_refused() -> None:
    device = Listener().attach(Scripted([DeviceLost("unplugged")], ["number 17", "number 18"]))
    with pytest.raises(DeviceRefused, match="another device, number 18 instead of number 17"):
        device.read(0.1)


def test_who_gives_up_gets_what_it_was_lost_by() -> None:
    listener = Listener()
    scripted = Scripted([DeviceLost("unplugged")], [None, *[DeviceLost("away")] * 1_000_000])
    device = listener.attach(scripted)
    scripted.tried.clear()
    raised: list[Exception] = []

    def read() -> None:
        try:
            device.read(0.1)
        except DeviceError as error:
            raised.append(error)

    thread = threading.Thread(target=read)
    thread.start()
    assert scripted.tried.wait(10.0)
    device.give_up()
    thread.join(10.0)
    assert [str(error) for error in raised] == ["unplugged"]
    assert listener.back == []


def test_a_device_that_is_being_closed_is_not_attached_again() -> None:
    listener = Listener()
    device = listener.attach(Scripted([DeviceLost("closed under the reader")]))
    device.close()
    with pytest.raises(DeviceLost, match="closed under the reader"):
        device.read(0.1)
    assert listener.lost == []
