"""Rigs of robots that people have: geometry and limits with their source, for a tracker; to be copied and adapted."""

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

from acquisition.recording.errors import shown
from acquisition.recording.rig import rig_text
from calibrate.errors import DataError

FOLDER = Path(__file__).parents[1] / "shipped_rigs"


def shipped_rigs() -> Mapping[str, Path]:
    """Files by name, in the order of the alphabet."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


def shipped_text(name: str) -> str:
    """The text of a shipped rig. DataError for an unknown name."""
    rigs = shipped_rigs()
    if name not in rigs:
        near = get_close_matches(name, rigs, 3, 0.4) or list(rigs)
        raise DataError(f"no shipped rig {shown(name)}; there is {', '.join(near)}: calibeam rig list shows all")
    return rig_text(rigs[name])


def first_comment(text: str) -> str:
    """What the first line of a rig file says of it."""
    return text.splitlines()[0].removeprefix("#").strip()
