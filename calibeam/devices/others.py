"""Instruments of plug-ins: a package of its own brings driver and emulator, a rig file names them.

[project.entry-points."calibeam.devices"]          in the package's pyproject.toml
lab-thermometer = "lab_thermometer:KIND"           a `DeviceKind`

[[devices.other]]                                  in the rig file
name = "hall"
driver = "lab-thermometer"
settings = { host = "192.168.1.20", port = 4000 }
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from acquisition.recording.rig.devices import OtherDevice
from calibrate.plug_ins import DEVICES, PlugInError, plug_ins
from drivers.clock import Clock
from drivers.device import Device
from drivers.errors import DeviceRefused


@dataclass(frozen=True)
class DeviceKind:
    """What an entry point of the group calibeam.devices is.

    `settings`: a msgspec Struct whose fields are the keys of the rig file; an unknown key or a wrong type is refused.
    `driver`: (settings, name, clock) to a device of that name, not connected. `emulator`: "module:function" that gives
    a bench from world and settings (simulators/wire.py), or "". `silence_s`: without a sample it counts as lost.
    """

    settings: type[msgspec.Struct]
    driver: Callable[[Any, str, Clock], Device]
    emulator: str = ""
    silence_s: float = 0.5


@dataclass(frozen=True)
class Other:
    """A driver, made."""

    device: Device
    silence_s: float
    package: str


def other_drivers(others: Sequence[OtherDevice], clock: Clock) -> list[Other]:
    """The drivers of the rig's further instruments. DeviceRefused naming instrument, package and what is wrong."""
    return [_driver(other, clock) for other in others]


def emulated_others(others: Sequence[OtherDevice], announced: Mapping[str, Any]) -> tuple[OtherDevice, ...]:
    """The same instruments where emulators announced them; one that is not emulated is where it was."""
    return tuple(
        msgspec.structs.replace(other, settings={**other.settings, **announced.get(other.name, {})}) for other in others
    )


def _driver(other: OtherDevice, clock: Clock) -> Other:
    found = next((one for one in plug_ins(DEVICES) if one.name == other.driver), None)
    if found is None:
        known = ", ".join(one.name for one in plug_ins(DEVICES)) or "none"
        raise DeviceRefused(
            f"{other.name}: no installed package brings the driver '{other.driver}' (there are: {known}); install it, "
            "or correct [[devices.other]] of the rig file"
        )
    try:
        kind = found.load(lambda what: isinstance(what, DeviceKind), "a calibeam.devices.others.DeviceKind")
        assert isinstance(kind, DeviceKind)  # noqa: S101 - asked for in the line above
        settings = msgspec.convert(dict(other.settings), kind.settings)
        unknown = sorted(set(other.settings) - {field.encode_name for field in msgspec.structs.fields(kind.settings)})
        if unknown:
            raise DeviceRefused(f"{other.name}: the driver '{other.driver}' has no setting '{unknown[0]}'; delete it")
        device = kind.driver(settings, other.name, clock)
    except PlugInError as why:
        raise DeviceRefused(f"{other.name}: {why}; correct or remove the package") from why
    except msgspec.ValidationError as why:
        raise DeviceRefused(f"{other.name}: settings of [[devices.other]] in the rig file: {why}") from why
    except ValueError as why:
        raise DeviceRefused(f"{other.name}: {found.package}: {why}") from why
    if device.name != other.name:
        raise DeviceRefused(f"{other.name}: {found.package} names its device '{device.name}'; correct it")
    return Other(device, kind.silence_s, found.package)
