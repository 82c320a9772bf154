"""The program: the only place where drivers, acquisition, calibrate and simulators are joined.

In a notebook: `calibeam.open("recording.mcap")`, see docs/python.md.
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from calibeam.notebook import Session

# The matrices of a session are small: on a busy machine the threads of a linear-algebra library wait for each other,
# and a fit takes ten times as long (decision 0003). Stands before numpy is loaded; a user's own setting goes first.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def open(path: Path | str) -> "Session":  # noqa: A001 - `calibeam.open` is what a notebook says
    """A recording (.mcap) or session folder, to be identified, diagnosed, drawn and reported.

    RecordingError where it is neither, with the reason.
    """
    from calibeam.notebook import open_recording  # only now: the command line starts without it

    return open_recording(path)
