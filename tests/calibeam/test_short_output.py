"""What `identify` and `diagnose` print by default: the verdict first, then at most 25 lines of a usual terminal."""

from pathlib import Path

import pytest

from calibeam.cli import run

DATA = Path(__file__).parents[1] / "golden" / "data"
RECORDINGS = (DATA / "demo.mcap", DATA / "formats" / "tracker", DATA / "sessions" / "pose-worn-bearing")
MOST_LINES, WIDTH = 25, 80


def printed(command: str, recording: Path, folder: Path, capsys, *more: str) -> list[str]:
    run([command, str(recording), "--out", str(folder / f"{command}.json"), *more])
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("recording", RECORDINGS, ids=lambda path: path.name)
@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_the_verdict_is_first_and_the_rest_fits_a_screen(recording, command, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    short = printed(command, recording, tmp_path, capsys)
    assert len(short) <= MOST_LINES, "\n".join(short)
    assert short[0].startswith(
        {"identify": ("The ", "No "), "diagnose": ("Recording and", "Mism", "1 ", "2 ")}[command]
    )
    verbose = printed(command, recording, tmp_path, capsys, "--verbose")
    assert verbose[0] == short[0]
    assert len(verbose) > len(short)
