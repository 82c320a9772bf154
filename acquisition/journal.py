"""Where a session's samples and events go."""

from collections.abc import Mapping
from typing import Any, Protocol

from acquisition.sample import Sample


class Journal(Protocol):
    """The recording, or a test's list."""

    def sample(self, sample: Sample) -> None: ...

    def event(self, kind: str, detail: Mapping[str, Any]) -> None: ...
