"""The program: the only place where drivers, acquisition, calibrate and simulators are joined.

In a notebook: `calibeam.open("recording.mcap")`, `calibeam.session("rig.toml", q_rad, positions_m)` or
`calibeam.open_model("model.json")`, and the errors that they raise; see docs/python.md.
"""

import importlib
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from acquisition.errors import AcquisitionError
    from acquisition.recording import RecordingError, RigFileError, SamplesError
    from calibeam.notebook import Model, Session, open_model
    from calibeam.notebook import open_recording as open  # noqa: A004 - `calibeam.open` is what a notebook says
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


def __getattr__(name: str) -> object:
    """The name, from its module, loaded only now: the command line starts without what a notebook needs."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, inner = _PLACES[name]
    return getattr(importlib.import_module(module), inner)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
