"""How each device is: live, stale, lost or not heard yet; how fast, what is missing, and what to do about it."""

from collections import deque
from collections.abc import Mapping

from msgspec import Struct

from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import EncoderDriver
from calibeam.devices.encoders import LEAST_RATE
from calibeam.live.latest import DeviceReadings

STALE_S = 0.3  # readers themselves give up after 0.5 s; sooner, a busy machine would make a page flicker
STALE_PERIODS = 5.0  # of a device slower than that
RATE_OVER_S = 2.0


class Health(Struct, frozen=True):
    """One device. `state`: "live", "stale", "lost", "waiting"; `says`: what is wrong and what to do, or nothing."""

    device: str
    state: str
    age_s: float | None
    rate_hz: float | None
    asked_hz: float | None
    lost: int
    says: str


def asked_rates(rig: Rig) -> dict[str, float | None]:
    """The rig's devices and the rates they are asked for (Hz); None: it sends at a pace of its own."""
    psd, encoders, robot = rig.devices.psd, rig.devices.encoders, rig.devices.robot
    rates: dict[str, float | None] = {}
    if robot is not None:
        rates["robot"] = robot.rate_hz
    if psd is not None:
        rates["psd"] = psd.rate_hz
    if rig.devices.tracker is not None:
        rates["tracker"] = rig.devices.tracker.rate_hz
    if encoders is not None:
        rates["encoders"] = encoders.sync_hz if encoders.driver is EncoderDriver.CIA406 else None
    return rates | {other.name: None for other in rig.devices.others}


class Watch:
    """Remembers the last seconds of counts, from which rates come; asked a few times a second, from one thread."""

    def __init__(self, asked_hz: Mapping[str, float | None]) -> None:
        self.asked_hz = dict(asked_hz)
        self._marks: dict[str, deque[tuple[float, float, int]]] = {name: deque() for name in asked_hz}

    def fresh(self, device: str, heard: DeviceReadings, now_s: float) -> bool:
        """Whether its newest sample may be shown as what is."""
        return heard.why is None and heard.block is not None and _age_s(heard, now_s) <= self._limit_s(device)

    def look(self, device: str, heard: DeviceReadings, now_s: float) -> Health:
        """The device now."""
        asked_hz = self.asked_hz.get(device)
        if heard.block is None:
            if heard.why is not None:
                return Health(device, "lost", None, None, asked_hz, heard.lost, heard.why)
            return Health(device, "waiting", None, None, asked_hz, heard.lost, "no sample yet: it is being connected")
        age_s, rate_hz = _age_s(heard, now_s), self._rate(device, heard, now_s)
        if heard.why is not None:
            return Health(device, "lost", age_s, None, asked_hz, heard.lost, heard.why)
        if age_s > self._limit_s(device):
            says = f"no new sample for {age_s:.1f} s: check its cable and power"
            return Health(device, "stale", age_s, None, asked_hz, heard.lost, says)
        return Health(device, "live", age_s, rate_hz, asked_hz, heard.lost, _slow(rate_hz, asked_hz, heard.lost))

    def _limit_s(self, device: str) -> float:
        asked_hz = self.asked_hz.get(device)
        return STALE_S if asked_hz is None else max(STALE_S, STALE_PERIODS / asked_hz)

    def _rate(self, device: str, heard: DeviceReadings, now_s: float) -> float | None:
        """Samples a second of the device's own clock; None until there are two looks to compare."""
        marks = self._marks.setdefault(device, deque())
        assert heard.block is not None  # noqa: S101 - asked by look
        device_s = float(heard.block.device_s[-1])
        if device_s != device_s:  # NaN: it has no clock of its own
            device_s = float(heard.block.host_s[-1])
        if marks and device_s < marks[-1][1]:  # restarted
            marks.clear()
        marks.append((now_s, device_s, heard.samples))
        while now_s - marks[0][0] > RATE_OVER_S and len(marks) > 2:
            marks.popleft()
        span_s = device_s - marks[0][1]
        return (heard.samples - marks[0][2]) / span_s if span_s > 0.0 else None


def _age_s(heard: DeviceReadings, now_s: float) -> float:
    assert heard.block is not None  # noqa: S101 - asked by its callers
    return max(0.0, now_s - float(heard.block.host_s[-1]))


def _slow(rate_hz: float | None, asked_hz: float | None, lost: int) -> str:
    if rate_hz is None or asked_hz is None or rate_hz >= LEAST_RATE * asked_hz:
        return ""
    why = "samples are lost on the way" if lost else "it cannot keep up"
    return f"{rate_hz:.0f} of {asked_hz:.0f} Hz, {why}: lower the rate in the rig file, or free the line"
