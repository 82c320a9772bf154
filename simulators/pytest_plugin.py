"""A pytest fixture that emulates rigs; in a project's top conftest.py:

pytest_plugins = ["simulators.pytest_plugin"]

def test_my_driver(start_emulators):
emulators = start_emulators(tomllib.loads(text), time_scale=2.0)
emulators.inject("psd", "silence", count=10)
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from typing import Any

import pytest

from simulators.process import Emulators


@pytest.fixture
def start_emulators() -> Iterator[Callable[..., Emulators]]:
    """Starts the emulators of a rig, as often as a test likes; all have ended when the test has."""
    with ExitStack() as running:

        def start(rig: Mapping[str, Any], **options: Any) -> Emulators:
            return running.enter_context(Emulators(rig, **{"links": False, **options}))

        yield start
