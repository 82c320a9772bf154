"""Which recordings lie below a folder (MCAP files, session folders), and what shows that one changed.

Also the settings of a run over a fleet: its workers, and the names of the files that it writes.
"""

import hashlib
import os
import re
from dataclasses import dataclass, field
from datetime import date
from enum import Enum
from pathlib import Path

from calibrate.errors import DataError


class Engine(Enum):
    """Joblib's names for where the work is done."""

    LOKY = "loky"
    DASK = "dask"


@dataclass(frozen=True)
class Workers:
    """Which workers, how many of our own (one a core), and where a cluster's scheduler listens."""

    engine: Engine = Engine.LOKY
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    scheduler: str | None = None


TABLE, PAGE = "fleet.parquet", "fleet.html"
JOURNAL = "fleet.rows.jsonl"  # rows of a run that is not over, or was killed


MCAP = ".mcap"
RIG, SAMPLES = "rig.toml", ("samples.csv", "samples.parquet")
DATE = re.compile(r"(?<!\d)(?:19|20)\d\d-\d\d-\d\d(?!\d)")  # ISO 8601, in years that no serial number is likely to hold
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class Found:
    """A recording or session folder as it lies on the disk."""

    path: Path  # absolute: workers elsewhere see the same files; of a session of several parts the folder
    name: str  # below the folder that was searched; of several parts that of the first, as when it was alone
    size_bytes: int
    modified_ns: int

    @property
    def date(self) -> str:
        """The last date (YYYY-MM-DD) in the name, "" without one: what a person wrote there goes before the clock."""
        dates = [text for text in DATE.findall(self.name) if _is_day(text)]
        return dates[-1] if dates else ""

    @property
    def group(self) -> str:
        """The first folder of the name, "" for a recording that lies in none."""
        head, _, rest = self.name.partition("/")
        return head if rest else ""


def find_recordings(folder: Path, but: Path) -> tuple[Found, ...]:
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
            found.append(_found(root, Path(here), Path(here)))
            folders.clear()  # what lies in a session folder belongs to it
            continue
        session = parts_of(Path(here))
        if len(session) > 1:
            found.append(_found(root, Path(here), session[0]))
            files = [name for name in files if Path(here, name) not in session]
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        alone = [Path(here, name) for name in files if name.endswith(MCAP)]
        found += [_found(root, path, path) for path in alone]
    if not found:
        raise DataError(
            f"{folder}: no recording (*{MCAP}) and no session folder ({RIG} with {SAMPLES[0]}) in it or below; "
            "give the folder that holds them"
        )
    return tuple(sorted(found, key=lambda one: one.name))


def content_sha256(path: Path) -> str:
    """SHA-256 of a recording, of a folder that of rig and samples, or of all parts. OSError where it cannot be read."""
    digest = hashlib.sha256()
    for part in parts_of(path):
        digest.update(f"{part.name}\n{part.stat().st_size}\n".encode() if path.is_dir() else b"")
        with part.open("rb") as file:
            while block := file.read(BLOCK_BYTES):
                digest.update(block)
    return digest.hexdigest()


def parts_of(path: Path) -> list[Path]:
    """The files of a recording: itself, rig and samples of a session folder, or all parts of a session in a folder."""
    if not path.is_dir():
        return [path]
    if (path / RIG).is_file():
        return [path / name for name in (RIG, *SAMPLES) if (path / name).exists()]
    from acquisition.recording.mcap import parts  # with numpy: a worker, which loads this file, does without

    return parts(path)


def _found(root: Path, path: Path, named: Path) -> Found:
    stats = [part.stat() for part in parts_of(path) if part.exists()]  # a dangling link is found, and fails when read
    size_bytes, modified_ns = sum(s.st_size for s in stats), max((s.st_mtime_ns for s in stats), default=0)
    return Found(path, named.relative_to(root).as_posix(), size_bytes, modified_ns)


def _is_day(text: str) -> bool:
    try:
        date.fromisoformat(text)
    except ValueError:
        return False
    return True
