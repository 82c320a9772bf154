"""For pytest in other projects: `calibeam_emulation`, the emulated devices of a rig for one test or one module.

pytest loads it by its entry point, so nothing of calibeam is imported before a test asks for it.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from calibeam.emulation import Emulation

Emulate = Callable[..., "Emulation"]


def _emulating() -> Generator[Emulate]:
    with ExitStack() as running:

        def emulate(rig: str | Path, *, seed: int | None = None, time_scale: float | None = None) -> "Emulation":
            from calibeam.emulation import Emulation
            from calibeam.rig_files import rig_path

            return running.enter_context(Emulation(rig_path(Path(rig)).resolve(), seed=seed, time_scale=time_scale))

        yield emulate


@pytest.fixture
def calibeam_emulation() -> Generator[Emulate]:
    """`calibeam_emulation("ur5e")` starts the emulators of a rig file or a shipped rig, and ends them with the test.

    What it returns has `address`: device -> where it listens, and `ask` for faults (docs/protocols/faults.md).
    """
    yield from _emulating()


@pytest.fixture(scope="module")
def calibeam_module_emulation() -> Generator[Emulate]:
    """The same for a whole module: emulators take a second to start."""
    yield from _emulating()
