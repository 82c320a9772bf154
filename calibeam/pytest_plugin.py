"""For pytest in other projects: the emulated devices of a rig for one test.

def test_my_driver(start_emulators):
    emulators = start_emulators("ur5e", time_scale=2.0)
    emulators.inject("robot", "silence", count=10)

pytest loads this by its entry point, so nothing else of calibeam is imported before a test asks for it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from simulators.process import Emulators


@pytest.fixture
def start_emulators() -> Iterator[Callable[..., "Emulators"]]:
    """Starts the emulators of a rig, as often as a test likes; all have ended when the test has.

    The rig is a path, the name of a shipped one, or what `tomllib` reads of a file; options are those of Emulators.
    """
    with ExitStack() as running:

        def start(rig: str | Path | Mapping[str, Any], **options: Any) -> "Emulators":
            from simulators.process import Emulators

            content = rig if isinstance(rig, Mapping) else _content(Path(rig))
            return running.enter_context(Emulators(content, **{"links": False, **options}))

        yield start


def _content(given: Path) -> Mapping[str, Any]:
    from acquisition.recording.rig import plain_rig, rig_text
    from calibeam.rig_files import rig_path

    path = rig_path(given)
    return plain_rig(rig_text(path), str(path))
