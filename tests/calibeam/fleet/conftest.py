"""A reader of recordings that loads nothing: what a file's name says is what it does to the process that reads it."""

import sys
from pathlib import Path

import pytest

from calibeam.software import SOFTWARE

READER = Path(__file__).with_name("reader.py")


@pytest.fixture
def reader() -> tuple[str, ...]:
    """The command of a process that a worker may start in place of the real one."""
    return (sys.executable, "-S", str(READER), SOFTWARE)


@pytest.fixture
def folder(tmp_path: Path):
    """Makes files under these names, each of its own content."""

    def make(*names: str) -> Path:
        root = tmp_path / "fleet"
        for name in names:
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(name)
        return root

    return make
