"""[devices.psd] and [devices.encoders] for every driver: what is taken, and what a mistake is told."""

import re
from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import load_rig
from acquisition.recording.rig.devices import EncoderDriver, PsdDriver

ROOT = Path(__file__).parents[3]
PAIR = (ROOT / "rigs" / "ur5e-dual-kpa101.toml").read_text()
PLAIN = re.sub(
    r'driver = "cia406"(.*?)nodes = [^\n]*',
    r'driver = "can-dbc"\1dbc = "rigs/encoders-plain.dbc"\nsignals = ["A.A", "B.A", "C.A", "D.A", "E.A", "F.A"]',
    PAIR,
    flags=re.DOTALL,
)
SOCKET = PLAIN.replace('interface = "slcan"', 'interface = "socketcan"')


def loaded(tmp_path, text: str):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return load_rig(path)


def test_the_shipped_pair(tmp_path):
    psd = loaded(tmp_path, PAIR).devices.psd
    assert psd.driver is PsdDriver.KPA101
    assert psd.ports == ("out/emulated/psd1", "out/emulated/psd2")
    assert psd.x_signs == (-1, -1)


def test_plain_encoders(tmp_path):
    encoders = loaded(tmp_path, PLAIN).devices.encoders
    assert encoders.driver is EncoderDriver.CAN_DBC
    assert len(encoders.signals) == 6


def test_files_are_looked_for_next_to_the_rig_file(tmp_path):
    text = PLAIN.replace('driver = "kpa101"', 'driver = "kpa101"\nerror_maps = ["maps/1.json", ""]', 1)
    devices = loaded(tmp_path, text).devices
    assert devices.encoders.dbc == str(tmp_path / "rigs/encoders-plain.dbc")
    assert devices.psd.error_maps == (str(tmp_path / "maps/1.json"), "")
    absolute = text.replace("maps/1.json", "/opt/maps/1.json")
    assert loaded(tmp_path, absolute).devices.psd.error_maps[0] == "/opt/maps/1.json"


def test_an_adapter_by_serial_number_and_further_words(tmp_path):
    text = re.sub(r'channel = "[^\n]*', 'serial_number = "A1"\noptions = { rtscts = true }', PAIR)
    encoders = loaded(tmp_path, text).devices.encoders
    assert (encoders.channel, encoders.serial_number) == ("", "A1")
    assert dict(encoders.options) == {"rtscts": True}


@pytest.mark.parametrize(
    ("text", "old", "new", "says"),
    [
        (PAIR, "rate_hz = 200.0", "rate_hz = 1000.0", "a pair of KPA101 gives at most 400; write rate_hz = 200"),
        (PAIR, "ports =", 'serial_numbers = ["1", "2"]\nports =', "either 'ports' .* or 'serial_numbers'"),
        (PAIR, "ports =", 'port = "x"\nports =', "'port' does not belong to driver \"kpa101\"; delete it"),
        (PAIR, '"pin-cushion"', '"quadrant"', "needs 'spot_radius_m'"),
        (PAIR, '"pin-cushion"', '"pincushion"', "did you mean 'pin-cushion'"),
        (PAIR, "x_signs = [-1, -1]", "x_signs = [-1, 2]", "x_signs"),
        (PAIR, "nodes = [", 'dbc = "x"\nnodes = [', "'dbc' does not belong to driver \"cia406\""),
        (PAIR, "channel =", 'serial_number = "A"\nchannel =', "either 'channel' or 'serial_number'"),
        (
            PAIR,
            'interface = "slcan"',
            'interface = "pcan"\nserial_number = "A"',
            "either 'channel'|belongs to interface",
        ),
        (PLAIN, 'dbc = "rigs/encoders-plain.dbc"\n', "", "needs 'dbc', the file"),
        (SOCKET, "dbc =", 'stamp = "hardware"\ndbc =', 'stamp = "hardware": interface "socketcan" gives no stamps of'),
        (PLAIN, "dbc =", 'stamp = "sampled"\ndbc =', "unknown value 'sampled'; known are arrived, hardware"),
        (
            PAIR,
            "nodes =",
            'stamp = "arrived"\nnodes =',
            'stamp = "arrived" belongs to driver "can-dbc"; rows of "cia406"',
        ),
        (PLAIN, '"F.A"', '"A.A"', "names one twice"),
        (PLAIN, ', "F.A"', "", "names 5 encoders, the arm has 6 joints"),
    ],
)
def test_a_mistake_is_reported_with_its_remedy(tmp_path, text, old, new, says):
    assert old in text
    with pytest.raises(RigFileError) as refused:
        loaded(tmp_path, text.replace(old, new))
    assert re.search(says, str(refused.value)), refused.value
