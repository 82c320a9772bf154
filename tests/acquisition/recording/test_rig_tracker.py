"""[devices.tracker] of a rig file: one line, known columns, a unit, and nothing that contradicts itself."""

from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import load_rig, parse_rig, rig_text
from acquisition.recording.rig.devices import TrackerDriver

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-tracker.toml"
TEXT = rig_text(RIG)
COLUMNS = 'columns = ["time", "x", "y", "z", "status"]'
WHERE = TEXT[TEXT.index('host = "127.0.0.1"') : TEXT.index("port = 5010") + len("port = 5010")]


def test_the_shipped_tracker() -> None:
    tracker = load_rig(RIG).devices.tracker
    assert tracker is not None
    assert tracker.driver is TrackerDriver.ASCII_LINES
    assert (tracker.length_unit, tracker.separator, tracker.good) == ("mm", ";", ("0",))
    assert not tracker.is_serial


@pytest.mark.parametrize(
    "line", ['port = 5010\ntransport = "udp"', 'serial_port = "/dev/ttyUSB0"', 'serial_number = "A1"']
)
def test_other_lines(line: str) -> None:
    assert parse_rig(TEXT.replace(WHERE, line, 1), "rig.toml").devices.tracker is not None


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('length_unit = "mm"', "", "length_unit"),
        ('length_unit = "mm"', 'length_unit = "cm"', "cm"),
        ("port = 5010", "", "needs either 'host' and 'port'"),
        ("port = 5010", 'port = 5010\nserial_port = "a"', "and one only"),
        (WHERE, 'serial_port = "a"\ntransport = "udp"', "belong to a network"),
        ("port = 5010", 'port = 5010\ntransport = "udp"\ntrigger = "M"', "only receives"),
        (COLUMNS, 'columns = ["x", "y", "status"]', "no 'z'"),
        (COLUMNS, 'columns = ["x", "y", "z", "x", "status"]', "names one twice"),
        (COLUMNS, 'columns = ["x", "y", "z", "azimuth", "status"]', "'azimuth' in columns is not known"),
        (COLUMNS, 'columns = ["x", "y", "z"]', "'good' a status column"),
        ('good = ["0"]', "", "needs 'good'"),
        (COLUMNS, COLUMNS + '\nmembers = { x = "p.0" }', "'members' does not belong to driver"),
        (COLUMNS, "", "no 'x'"),
        ('separator = ";"', 'separator = ";;"', "separator"),
        ('separator = ";"', 'separator = ","\ndecimal = ","', "stands in numbers, too"),
        ("rate_hz = 100.0", "rate_hz = 1.0", "counts as silent"),
        (
            "\n[devices.tracker]\n",
            '\n[devices.psd]\ndriver = "psd-daq"\nport = "a"\n[devices.tracker]\n',
            "write two rig files",
        ),
    ],
)
def test_sections_that_contradict_themselves(old: str, new: str, says: str) -> None:
    assert old in TEXT
    with pytest.raises(RigFileError, match=says):
        parse_rig(TEXT.replace(old, new, 1), "rig.toml")
