"""What a CAN log does not state, or its reader leaves out, is stated by the import: lines of frames, zones of times."""

import struct
from pathlib import Path

import can
import pytest

from acquisition.recording import read
from acquisition.recording.can_frames import frames_of
from acquisition.recording.can_log import CanImport, import_can

HEAD = "date Mon Apr 06 10:14:13.000 am 2020\nbase hex timestamps absolute\n"
FRAMES = (
    "0.0010 1 101 Rx d 8 00 00 00 00 00 00 00 00",
    "0.0020 1 102x Rx d 2 01 02",
    "0.0030 1 103 Tx d 1 03",
)


def imported(path: Path, rig_source: str) -> tuple[CanImport, list[int]]:
    out = path.with_suffix(".mcap")
    done = import_can(path, out, rig_text=rig_source, software="calibeam")
    return done, [frame.can_id for stream in read(out).streams.values() for frame in frames_of(stream)]


@pytest.mark.parametrize(
    "head",
    [
        HEAD,  # as BusMaster writes it
        HEAD + "no internal events logged\n",
        HEAD + "// version 9.0.0\n",
        HEAD + "internal events logged\nBegin Triggerblock Mon Apr 06 10:14:13.000 am 2020\n",
        "",
    ],
)
def test_the_first_frame_of_an_asc_log_is_read_whatever_stands_above_it(
    head: str, tmp_path: Path, rig_source: str
) -> None:
    path = tmp_path / "bus.asc"
    path.write_text(head + "\n".join(FRAMES) + "\n")
    done, ids = imported(path, rig_source)
    assert ids == [0x101, 0x102, 0x103]
    assert done.damage is None
    assert not [line for line in done.remarks if "not read" in line]


def test_lines_of_frames_that_are_not_read_are_counted(tmp_path: Path, rig_source: str) -> None:
    path = tmp_path / "bus.asc"
    whole_second = "1 1 104 Rx d 1 04"  # the reader wants a time with a fraction
    path.write_text(HEAD + "\n".join((*FRAMES, whole_second, "1.5 1 Statistic: D 3 R 0", "1.6 1 105 Rx d 1 05")) + "\n")
    done, ids = imported(path, rig_source)
    assert ids == [0x101, 0x102, 0x103, 0x105]
    assert any("1 of 5 lines of frames was not read, the first in line 6" in line for line in done.remarks)


def test_an_asc_log_whose_times_count_from_line_to_line_is_named(tmp_path: Path, rig_source: str) -> None:
    path = tmp_path / "bus.asc"
    path.write_text(HEAD.replace("absolute", "relative") + "\n".join(FRAMES) + "\n")
    done, _ = imported(path, rig_source)
    assert any("times count from line to line" in line and "timestamps absolute" in line for line in done.remarks)


@pytest.mark.parametrize(
    ("suffix", "application", "says"),
    [
        (".blf", 2, "local time of the computer that recorded it"),  # CANoe
        (".blf", 5, "states no zone"),  # python-can
        (".asc", None, "time zone of this computer"),
        (".log", None, None),
        (".csv", None, None),
    ],
)
def test_the_zone_of_a_start_time_that_no_file_states_is_remarked(
    suffix: str, application: int | None, says: str | None, tmp_path: Path, rig_source: str
) -> None:
    path = tmp_path / f"bus{suffix}"
    with can.Logger(path) as log:
        for number in range(3):
            stamp_s = 1_700_000_000 + 0.01 * number
            log.on_message_received(can.Message(stamp_s, 5, is_extended_id=False, data=[number], channel=0))
    if application is not None:
        raw = bytearray(path.read_bytes())
        raw[8] = application
        path.write_bytes(raw)
        hour = struct.unpack_from("<H", raw, 48)[0]  # of the start time: 2023-11-14 22:13:20 UTC
        assert hour == 22
    done, _ = imported(path, rig_source)
    zones = [line for line in done.remarks if "zone" in line or "UTC" in line]
    assert zones == [] if says is None else says in zones[0]
    if suffix == ".blf":
        assert read(path.with_suffix(".mcap")).started_utc.startswith("2023-11-14T22:13:20")
