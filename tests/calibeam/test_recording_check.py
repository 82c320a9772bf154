"""`calibeam check` of recordings: what is in them, how their clocks run, what is wrong, the exit code."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter
from acquisition.recording.rig import rig_text
from calibeam.cli import run

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


class Standing:
    def now_s(self) -> float:
        return 1000.0


@pytest.fixture
def log_of(tmp_path: Path) -> Callable[..., Path]:
    """A segment of a log: a stream of 2,000 samples of which some are left out, some at full scale."""

    def made(name: str, left_out: int = 0, saturated: int = 0, clock_s: float = 0.0) -> Path:
        folder = tmp_path / "log"
        folder.mkdir(exist_ok=True)
        number = np.delete(np.arange(2000), np.arange(500, 500 + left_out))
        volts = np.where(np.arange(number.size) < saturated, 10.0, 1.0)
        host_s = 1000.0 + (1.0 + 40e-6) * number * 1e-3 + 1e-4 * (number % 7)
        with RecordingWriter(
            folder / name, rig_text=rig_text(RIG), software="test", clock=Standing(), notes={"segment": "1"}
        ) as writer:
            writer.stream("psd", (Channel("sum_v", "V", full_scale=10.0),)).append(
                host_s, clock_s + number * 1e-3, number, {"sum_v": volts}
            )
        return folder / name

    return made


def test_a_good_recording_is_reported_with_its_rate_and_clock(log_of, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(log_of("segment-0001.mcap"))]) == 0
    said = capsys.readouterr().out
    assert "psd: samples: 2000, 999.8 a second over 2.0 s; clock +40.0 µs/s against the host" in said
    assert "not examined: readings of the encoders: no readings of encoders were recorded" in said  # the rig has some
    assert "nothing wrong in what was examined: gaps and order of the streams, time stamps" in said


def test_a_clock_that_is_the_hosts_own_is_not_compared_with_it(log_of, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(log_of("segment-0001.mcap", clock_s=999.999))]) == 0
    assert "stamped by the host's clock, arrive 1.34 ms later in the median" in capsys.readouterr().out


def test_saturation_fails_the_check_and_a_few_lost_samples_do_not(log_of, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(log_of("segment-0001.mcap", left_out=3, saturated=7))]) == 1
    said = capsys.readouterr().out
    assert "gap: stream psd: 3 samples missing" in said
    assert run(["check", str(log_of("segment-0002.mcap", left_out=3))]) == 0
    assert "information: gap: stream psd" in capsys.readouterr().out
    assert run(["check", str(log_of("segment-0003.mcap", left_out=300))]) == 0
    assert "warning: gap: stream psd" in capsys.readouterr().out
    assert "error: saturated: stream psd: sum_v at its full scale, 10 V, in 7 of 1997 samples, first at 0.000 s" in said


def test_every_segment_of_a_folder_is_checked(log_of, capsys: pytest.CaptureFixture[str]) -> None:
    log_of("segment-0001.mcap")
    folder = log_of("segment-0002.mcap", left_out=1).parent
    assert run(["check", str(folder), "--json"]) == 0
    first, second = (msgspec.json.decode(line) for line in capsys.readouterr().out.splitlines())
    assert first["findings"] == []
    assert first["streams"]["psd"]["clock"]["status"] == "found"
    assert [finding["problem"] for finding in second["findings"]] == ["gap"]
    assert [finding["severity"] for finding in second["findings"]] == ["information"]
