"""The PSD DAQ box on its port, with the verbs of the side channel."""

from collections.abc import Mapping
from typing import Any

from simulators.psd_daq.daq import LitFaces, PsdDaqBox
from simulators.psd_daq.line import DEFAULT_BAUD, TransmitLine
from simulators.psd_daq.wire import PsdDaqWire
from simulators.wire import Bench, SerialPort

DEFAULT_SERIAL_NUMBER = "CB-0001"


def build(world: LitFaces, rig: Mapping[str, Any], baud: int = DEFAULT_BAUD) -> Bench:
    """The box of `rig["devices"]["psd"]` with the faces of `rig["fixture"]`; its link is the rig's port, if any.

    Verbs: "psd.silence" {on} stops all that it says while sampling goes on; "psd.damage" {frames} turns one bit in
    each of the next so many data frames.
    """
    device = rig["devices"]["psd"]
    serial_number = str(device.get("serial_number", DEFAULT_SERIAL_NUMBER))
    box = PsdDaqBox(world, 2.0 * float(rig["fixture"]["half_size_m"]), serial_number, TransmitLine(baud))

    def silence(on: bool = True) -> None:
        box.silent = on

    def damage(frames: int = 1) -> None:
        box.damaged_frames = frames

    port = SerialPort("psd", PsdDaqWire(box, world), device.get("port"))
    return Bench((box,), (port,), {"psd.silence": silence, "psd.damage": damage}, box.clock)
