"""How a job can end when it is neither done nor lost."""

import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path


class PartialResult(Exception):  # noqa: N818 - it is a result
    """The job ended early, and what it had is kept; the message states where and how to go on. Exit code 3."""


class CheckFailed(Exception):  # noqa: N818 - a result of the check, not an error of it
    """Something that was checked is not as it should be; what, has been printed."""


@contextmanager
def taken_back(*outs: Path) -> Generator[None]:
    """Where Ctrl-C or SIGTERM ends the block, what it began at these places is removed; what stood there before stays.

    For what is made of other files: made again, it is whole. What was measured is kept (`PartialResult`).
    """
    before = {out: sorted(out.iterdir()) if out.is_dir() else [] for out in outs if out.exists()}
    try:
        yield
    except KeyboardInterrupt:
        for out in outs:
            begun = {out} if out not in before else {*out.iterdir()} - {*before[out]} if out.is_dir() else set()
            for path in begun:
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        raise


def interruption(why: KeyboardInterrupt) -> str:
    """What the user or the system did: Ctrl-C, or the signal that calibeam.cli turns into the same exception."""
    return str(why.args[0]) if why.args else "Ctrl-C"
