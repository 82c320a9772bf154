"""Two KPA101 on ports of their own, one for each face of the fixture, with the verbs of the side channel."""

from collections.abc import Mapping
from typing import Any

from simulators.kpa101.unit import Kpa101Unit, Kpa101Wire, LitFaces
from simulators.wire import Bench, SerialPort

DEFAULT_SERIAL_NUMBERS = ("69250001", "69250002")  # 69 is the family's prefix
TRANSIMPEDANCE_V_A = 1e5  # Thorlabs PDP90A: 100 kV/A


def build(world: LitFaces, rig: Mapping[str, Any]) -> Bench:
    """The pair of `rig["devices"]["psd"]`; links are the rig's `ports`, if any.

    Verbs: "psd.silence" {unit, on}; "psd.wiring" {unit, x_sign, sum_full_scale_v} rewires a unit.
    """
    device = rig["devices"]["psd"]
    numbers = device.get("serial_numbers", DEFAULT_SERIAL_NUMBERS)
    links = device.get("ports", (None, None))
    gain = float(device.get("transimpedance_v_a", TRANSIMPEDANCE_V_A))
    units = [Kpa101Unit(world, place, int(numbers[place]), gain) for place in (0, 1)]

    def silence(unit: int, on: bool = True) -> None:
        _one(units, unit).silent = on

    def wiring(unit: int, x_sign: int = -1, sum_full_scale_v: float = 10.0) -> None:
        _one(units, unit).x_sign, _one(units, unit).sum_volts = x_sign, sum_full_scale_v

    ports = [
        SerialPort(unit.name, Kpa101Wire(unit, lambda: world.time_s), link)
        for unit, link in zip(units, links, strict=True)
    ]
    return Bench(units, ports, {"psd.silence": silence, "psd.wiring": wiring})


def _one(units: list[Kpa101Unit], number: int) -> Kpa101Unit:
    if number not in (1, 2):
        raise ValueError(f"unit {number!r}: there are 1 and 2")
    return units[number - 1]
