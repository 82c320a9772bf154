"""Where a session's samples and events go."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Protocol

from acquisition.bench import Look
from acquisition.plan import PoseKey
from acquisition.sample import Sample


class Journal(Protocol):
    """The recording, or a test's list."""

    def sample(self, sample: Sample) -> None: ...

    def event(self, kind: str, detail: Mapping[str, Any]) -> None: ...


def key_detail(key: PoseKey, look: Look) -> dict[str, Any]:
    """Of the event "sample": which pose it is, and when it was read, so that the streams tell what happened about."""
    detail: dict[str, Any] = {"pose": asdict(key)}
    if look.window_s is not None:
        detail |= {"psd_from_s": look.window_s[0], "psd_to_s": look.window_s[1]}
    return detail
