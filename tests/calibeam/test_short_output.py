"""What `identify` and `diagnose` print by default: the verdict first, then at most 25 lines of a usual terminal."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from calibeam.cli import run
from calibeam.commands import diagnose, identify

DATA = Path(__file__).parents[1] / "golden" / "data"
DEMO = DATA / "demo.mcap"
RECORDINGS = (DEMO, DATA / "formats" / "tracker", DATA / "sessions" / "pose-worn-bearing")
CASES = [(command, recording) for command in ("identify", "diagnose") for recording in RECORDINGS]
LONGEST = ("diagnose", DEMO)  # daily: the other recordings, of which one has a finding and one has none
MOST_LINES, WIDTH = 25, 80
WORK = {"identify": (identify, "identify_session"), "diagnose": (diagnose, "diagnose_recording")}


def printed(command: str, recording: Path, folder: Path, capsys, *more: str) -> list[str]:
    run([command, str(recording), "--out", str(folder / f"{command}.json"), *more])
    return capsys.readouterr().out.splitlines()


def once(work: Callable[..., Any]) -> Callable[..., Any]:
    """Its answer, made at the first call: printed short and at length is one and the same."""
    made: list[Any] = []

    def answer(*arguments: Any) -> Any:
        if not made:
            made.append(work(*arguments))
        return made[0]

    return answer


@pytest.mark.parametrize(
    ("command", "recording"),
    [pytest.param(*case, marks=[pytest.mark.endure] if case == LONGEST else []) for case in CASES],
    ids=lambda value: getattr(value, "name", value),
)
def test_the_verdict_is_first_and_the_rest_fits_a_screen(recording, command, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    module, work = WORK[command]
    monkeypatch.setattr(module, work, once(getattr(module, work)))
    short = printed(command, recording, tmp_path, capsys)
    assert len(short) <= MOST_LINES, "\n".join(short)
    assert short[0].startswith(
        {"identify": ("The ", "No "), "diagnose": ("Recording and", "Mism", "1 ", "2 ")}[command]
    )
    verbose = printed(command, recording, tmp_path, capsys, "--verbose")
    assert verbose[0] == short[0]
    assert len(verbose) > len(short)
