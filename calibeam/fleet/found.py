"""Which recordings lie below a folder: MCAP files and session folders, with what tells whether one has changed."""

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from calibrate.errors import DataError

MCAP = ".mcap"
RIG, SAMPLES = "rig.toml", ("samples.csv", "samples.parquet")
DATE = re.compile(r"(?<!\d)\d{4}-[01]\d-[0-3]\d(?!\d)")  # ISO 8601
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class Found:
    """A recording or session folder as it lies on the disk."""

    path: Path  # absolute: workers elsewhere see the same files
    name: str  # below the folder that was searched
    size_bytes: int
    modified_ns: int

    @property
    def date(self) -> str:
        """The last date (YYYY-MM-DD) in the name, "" without one: what a person wrote there goes before the clock."""
        dates = DATE.findall(self.name)
        return dates[-1] if dates else ""

    @property
    def group(self) -> str:
        """The first folder of the name, "" for a recording that lies in none."""
        head, _, rest = self.name.partition("/")
        return head if rest else ""


def recordings(folder: Path, but: Path) -> tuple[Found, ...]:
    """All below `folder` in the order of their names, hidden folders and `but` left out.

    DataError where there is no folder, or no recording in it.
    """
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder; give the folder that holds the recordings")
    root, left_out = folder.resolve(), but.resolve()
    found: list[Found] = []
    for here, folders, files in os.walk(root):
        if Path(here) == left_out and left_out != root:
            folders.clear()
            continue
        if RIG in files and any(name in files for name in SAMPLES):
            found.append(_found(root, Path(here)))
            folders.clear()  # what lies in a session folder belongs to it
            continue
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [_found(root, Path(here, name)) for name in files if name.endswith(MCAP)]
    if not found:
        raise DataError(
            f"{folder}: no recording (*{MCAP}) and no session folder ({RIG} with {SAMPLES[0]}) in it or below; "
            "give the folder that holds them"
        )
    return tuple(sorted(found, key=lambda one: one.name))


def content_sha256(path: Path) -> str:
    """SHA-256 of a recording, of a session folder that of rig and samples. OSError where it cannot be read."""
    digest = hashlib.sha256()
    for part in _parts(path):
        digest.update(f"{part.name}\n{part.stat().st_size}\n".encode() if path.is_dir() else b"")
        with part.open("rb") as file:
            while block := file.read(BLOCK_BYTES):
                digest.update(block)
    return digest.hexdigest()


def _found(root: Path, path: Path) -> Found:
    stats = [part.stat() for part in _parts(path) if part.exists()]  # a dangling link is found, and fails when read
    size_bytes, modified_ns = sum(s.st_size for s in stats), max((s.st_mtime_ns for s in stats), default=0)
    return Found(path, path.relative_to(root).as_posix(), size_bytes, modified_ns)


def _parts(path: Path) -> list[Path]:
    return [path / name for name in (RIG, *SAMPLES) if (path / name).exists()] if path.is_dir() else [path]
