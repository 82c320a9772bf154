"""What must hold within [devices.psd] and [devices.encoders] of a rig file, for each driver."""

from collections.abc import Iterator

from acquisition.recording.rig.devices import EncoderDriver, EncodersDevice, PsdDevice, PsdDriver, PsdHead
from acquisition.recording.rig.schema import Rig
from acquisition.recording.rig_lines import KeyPath

PSD: KeyPath = ("devices", "psd")
ENCODERS: KeyPath = ("devices", "encoders")
KPA101_MOST_HZ = 400.0  # two units on lines of 115200 baud
DAQ_ONLY = ("port", "serial_number")
PAIR_ONLY = ("ports", "serial_numbers", "length_m")
CIA406_ONLY, DBC_ONLY = ("nodes",), ("dbc", "signals", "units_per_turn")

Fault = tuple[KeyPath, str]


def instrument_faults(rig: Rig) -> Iterator[Fault]:
    """(key path, what is wrong and what to do), as the rules of rig_rules."""
    if rig.devices.psd is not None:
        yield from _psd_faults(rig.devices.psd)
    if rig.devices.encoders is not None:
        yield from _bus_faults(rig.devices.encoders)
        yield from _encoder_faults(rig.devices.encoders, rig.n_joints)


def _psd_faults(psd: PsdDevice) -> Iterator[Fault]:
    pair = psd.driver is PsdDriver.KPA101
    yield from _strangers(PSD, psd, DAQ_ONLY if pair else PAIR_ONLY, psd.driver.value)
    if pair and (psd.ports is None) == (psd.serial_numbers is None):
        yield (
            PSD,
            "[devices.psd] needs either 'ports' (two paths) or 'serial_numbers' (of two units), and one only",
        )
    if not pair and (psd.port is None) == (psd.serial_number is None):
        yield PSD, "[devices.psd] needs either 'port' (a path) or 'serial_number' (of its USB), and one only"
    if pair and psd.rate_hz > KPA101_MOST_HZ:
        yield (
            (*PSD, "rate_hz"),
            f"rate_hz = {psd.rate_hz:g}: a pair of KPA101 gives at most {KPA101_MOST_HZ:g}; write rate_hz = 200",
        )
    if pair and psd.head is PsdHead.QUADRANT and psd.spot_radius_m is None:
        yield (
            PSD,
            "[devices.psd] with head = \"quadrant\" needs 'spot_radius_m': its ratio says nothing of metres alone",
        )


def _bus_faults(encoders: EncodersDevice) -> Iterator[Fault]:
    if bool(encoders.channel) == (encoders.serial_number is not None):
        yield (
            ENCODERS,
            "[devices.encoders] needs either 'channel' or 'serial_number' (of a serial adapter's USB), and one only",
        )
    if encoders.serial_number is not None and encoders.interface != "slcan":
        yield (
            (*ENCODERS, "serial_number"),
            f'serial_number belongs to interface "slcan", here it is "{encoders.interface}"; name its channel, '
            "or give python-can's own word for a serial number in 'options'",
        )


def _encoder_faults(encoders: EncodersDevice, n_joints: int) -> Iterator[Fault]:
    plain = encoders.driver is EncoderDriver.CAN_DBC
    yield from _strangers(ENCODERS, encoders, CIA406_ONLY if plain else DBC_ONLY, encoders.driver.value)
    if plain and encoders.dbc is None:
        yield ENCODERS, "[devices.encoders] of driver \"can-dbc\" needs 'dbc', the file that describes the encoders"
    key = "signals" if plain else "nodes"
    named = encoders.signals if plain else encoders.nodes
    if len(named) != n_joints:
        yield (
            (*ENCODERS, key),
            f"{key} = {list(named)} names {len(named)} encoders, the arm has {n_joints} joints; name one per joint",
        )
    if len(set(named)) != len(named):
        yield (*ENCODERS, key), f"{key} = {list(named)} names one twice; every joint has its own"


def _strangers(
    path: KeyPath, section: PsdDevice | EncodersDevice, keys: tuple[str, ...], driver: str
) -> Iterator[Fault]:
    for key in keys:
        if getattr(section, key) not in (None, ()):
            yield (*path, key), f"'{key}' does not belong to driver \"{driver}\"; delete it"
