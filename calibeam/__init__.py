"""The program: the only place where drivers, acquisition, calibrate and simulators are joined.

In a notebook: `calibeam.open("recording.mcap")`, `calibeam.session("rig.toml", q_rad, positions_m)` or
`calibeam.open_model("model.json")`, and the errors that they raise; see docs/python.md.
"""

import importlib
import os
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from acquisition.errors import AcquisitionError
    from acquisition.recording import RecordingError, RigFileError, SamplesError
    from calibeam.notebook import Model, Session, open_model
    from calibeam.notebook import open_recording as open  # noqa: A004 - `calibeam.open` is what a notebook calls
    from calibeam.notebook import session_of_arrays as session
    from calibrate.errors import DataError
    from drivers.errors import DeviceError

__all__ = [
    "AcquisitionError",
    "DataError",
    "DeviceError",
    "Model",
    "RecordingError",
    "RigFileError",
    "SamplesError",
    "Session",
    "open",
    "open_model",
    "session",
]

# The matrices of a session are small: on a busy machine the threads of a linear-algebra library wait for each other,
# and a fit takes ten times as long (decision 0003). Stands before numpy is loaded; a user's own setting goes first.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


_PLACES = {
    "AcquisitionError": ("acquisition.errors", "AcquisitionError"),
    "DataError": ("calibrate.errors", "DataError"),
    "DeviceError": ("drivers.errors", "DeviceError"),
    "Model": ("calibeam.notebook", "Model"),
    "RecordingError": ("acquisition.recording", "RecordingError"),
    "RigFileError": ("acquisition.recording", "RigFileError"),
    "SamplesError": ("acquisition.recording", "SamplesError"),
    "Session": ("calibeam.notebook", "Session"),
    "open": ("calibeam.notebook", "open_recording"),
    "open_model": ("calibeam.notebook", "open_model"),
    "session": ("calibeam.notebook", "session_of_arrays"),
}


FOLDERS = ("drivers", "acquisition", "calibrate", "simulators")  # installed beside this package (decision 0039)


def check_folders() -> None:
    """ImportError where a package of somebody else comes before one of ours on the path."""
    here = Path(__file__).resolve().parents[1]
    for name in FOLDERS:
        found = find_spec(name)
        place = None if found is None or found.origin is None else Path(found.origin).resolve().parents[1]
        if place != here:
            raise ImportError(
                f"{name} is found in {place or 'no installed package'}, not beside calibeam in {here}: another package "
                "of that name comes first on the Python path; start from another folder, or install calibeam into "
                "an environment of its own (pipx install)"
            )


def __getattr__(name: str) -> object:
    """The name, from its module, loaded only now: the command line starts without what a notebook needs."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    check_folders()
    module, inner = _PLACES[name]
    return getattr(importlib.import_module(module), inner)


def __dir__() -> list[str]:
    """What is meant to be used: the names above, without what they are made of."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
