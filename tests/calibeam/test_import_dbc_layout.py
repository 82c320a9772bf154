"""A DBC file that places a signal wrongly: the import names the place that is smooth, and `check` finds an error."""

import math
import re
from pathlib import Path

import can
import numpy as np
import pytest

from acquisition.recording import read
from acquisition.recording.check_recording import LEFT_OUT, NO_ANSWER
from calibeam.cli import run
from drivers.can_dbc.description import NoReading

HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: one\n\n'
SCALE, OFFSET = 0.00038147554741, -12.5
FRAMES = 600


def rig(folder: Path, place: str, ends: str = "-12.5|12.5") -> Path:
    dbc = folder / "axis.dbc"
    dbc.write_text(f'{HEAD}BO_ 5 AXIS: 8 one\n SG_ Angle : {place} ({SCALE},{OFFSET}) [{ends}] "rad" one\n')
    path = folder / "rig.toml"
    path.write_text(
        'schema = 1\nname = "encoders"\n\n[devices.encoders]\ndriver = "can-dbc"\ninterface = "virtual"\n'
        f'channel = "bus"\ndbc = "{dbc}"\nsignals = ["AXIS.Angle"]\n'
    )
    return path


def log(folder: Path, angles_rad: np.ndarray, order: str = "big", at: int = 0) -> Path:
    """16 bits from byte `at` on, and a counter of 8 bits in byte 4."""
    path = folder / "bus.log"
    with can.Logger(path) as writer:
        for number, angle_rad in enumerate(angles_rad.tolist()):
            raw = round((angle_rad - OFFSET) / SCALE)
            data = bytearray(8)
            data[at : at + 2] = raw.to_bytes(2, order)  # pyright: ignore[reportArgumentType]
            data[4] = number % 256
            stamp_s = 1_700_000_000 + 0.01 * number
            writer.on_message_received(can.Message(stamp_s, 5, is_extended_id=False, data=data, channel=0))
    return path


def swing(amplitude_rad: float = 3.0) -> np.ndarray:
    return amplitude_rad * np.sin(math.tau * 0.2 * 0.01 * np.arange(FRAMES))


def imported(folder: Path, rig_path: Path, log_path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[Path, str, str]:
    """The recording, what the import printed, what `check` printed of it."""
    out = folder / "bus.mcap"
    assert run(["import", str(log_path), "--rig", str(rig_path), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    run(["check", str(out)])
    return out, printed, capsys.readouterr().out


@pytest.mark.parametrize(
    ("stated", "order", "at", "smooth"),
    [
        ("0|16@1+", "big", 0, "7|16@0+"),  # the other byte order
        ("7|16@0+", "little", 0, "0|16@1+"),
        ("8|16@0+", "big", 0, "7|16@0+"),  # the start bit of the least significant byte
        ("15|16@0+", "big", 0, "7|16@0+"),  # a byte too late
        ("3|16@1+", "little", 1, "8|16@1+"),
    ],
)
def test_a_place_in_which_the_angle_would_be_smooth_is_named(
    stated: str, order: str, at: int, smooth: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, printed, checked = imported(tmp_path, rig(tmp_path, stated, "0|0"), log(tmp_path, swing(), order, at), capsys)
    for said in (printed, checked):
        assert re.search(rf"axis\.dbc: AXIS\.Angle as {re.escape(stated)}: \d+ of 599 steps", said)
        assert f"as {smooth} the same frames are smooth" in said
        assert "faster than a joint turns in" in said
        assert "no errors" not in said
        assert "no answer" not in said
    assert "readings were left out; see the warnings above" in checked


def test_a_signal_in_its_place_is_not_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, printed, checked = imported(tmp_path, rig(tmp_path, "7|16@0+"), log(tmp_path, swing()), capsys)
    assert "warning" not in printed
    assert "no errors" in checked
    np.testing.assert_allclose(read(out).streams["encoders"].values["position_rad"][:, 0], swing(), atol=0.51 * SCALE)


def test_a_diagnosis_lists_readings_that_were_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, _, _ = imported(tmp_path, rig(tmp_path, "8|16@0+", "0|0"), log(tmp_path, swing()), capsys)
    assert run(["diagnose", str(out), "--out", str(tmp_path / "diagnosis.json")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no fault" not in said
    assert "no cause found in what was examined" in said
    assert re.search(
        r"readings of the encoders: encoder 1: readings left out of 600 rows: faster than a joint turns in \d+", said
    )


def test_readings_out_of_the_stated_range_are_counted_apart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angles_rad = swing()
    angles_rad[100:107] = 11.0  # beyond the stated 10 rad
    angles_rad[200] = 9.0  # a single jump
    out, printed, checked = imported(tmp_path, rig(tmp_path, "7|16@0+", "-10|10"), log(tmp_path, angles_rad), capsys)
    says = (
        "encoder 1: readings left out of 600 rows: out of the range that the signal states in 7, "
        "faster than a joint turns in 1"
    )
    assert says in printed
    assert says in checked
    assert "no errors" not in checked
    values = read(out).streams["encoders"].values
    assert np.flatnonzero(np.isnan(values["position_rad"][:, 0])).tolist() == [*range(100, 107), 200]
    assert values["no_reading"][[99, 100, 200], 0].tolist() == [0, 2, 3]


def test_the_reasons_of_the_driver_are_those_that_check_names() -> None:
    assert {NO_ANSWER, *LEFT_OUT} == {why.value for why in NoReading}
