"""Whether the compiled loops are at hand: numba's cache was filled for these sources, this numba, Python and processor.

Compiling takes seconds, and no first call shall wait for it. So it is done once, by `python -m calibrate.kernels`
(which `make` does at set-up); until then the numpy models serve, which give the same numbers. docs/decisions/0005.
"""

import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

SOURCES = tuple(Path(__file__).with_name(name) for name in ("compiled.py", "perturbed_loops.py"))

WORTH_POSES = 256  # below, a single fit is over before numba is imported (0.3 to 0.4 s, once a process)


def worth(poses: int) -> bool:
    """Whether a batch of that many poses should go through the compiled loops."""
    return poses >= WORTH_POSES and available()


@cache
def available() -> bool:
    """True when a call of a compiled loop starts at once. Decided at the first question, for the whole run."""
    marker = _marker()
    return marker.exists() and marker.read_text() == _processor()


def state_ready() -> None:
    """Leave the mark that `available` looks for; OSError where the folder of the sources cannot be written."""
    marker = _marker()
    marker.parent.mkdir(exist_ok=True)
    marker.write_text(_processor())
    available.cache_clear()


def _marker() -> Path:
    """Beside numba's own cache files, and named by what makes them stale: each source's date and size, and versions."""
    stats = [source.stat() for source in SOURCES]
    sources = "-".join(f"{stat.st_mtime_ns}-{stat.st_size}" for stat in stats)
    python = f"{sys.implementation.cache_tag}-numba{version('numba')}"
    return SOURCES[0].parent / "__pycache__" / f"compiled-{sources}-{python}.ready"


def _processor() -> str:
    from llvmlite import binding

    return f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}"
