"""The beat: what cannot be made is told, and neither stops nor hides what can."""

import asyncio
from contextlib import suppress

import msgspec
import pytest

from calibeam.live.app import Pulse
from calibeam.live.composer import Composer
from calibeam.live.stopping import Viewer, Viewers


@pytest.mark.parametrize(("broken", "whole"), [("state", "now"), ("now", "state")])
def test_one_kind_that_fails_is_reported_and_the_other_goes_on(rig, latest, clock, monkeypatch, broken, whole) -> None:
    composer = Composer(rig, latest, "session")

    def fail() -> str:
        raise ValueError("no faces")

    monkeypatch.setattr(composer, broken, fail)

    async def look() -> list[dict]:
        viewers, viewer = Viewers(clock), Viewer()
        viewers.add(viewer)
        beat = asyncio.create_task(Pulse(viewers, composer).run())
        messages = [msgspec.json.decode(await viewer.next()) for _ in range(2)]
        beat.cancel()
        with suppress(asyncio.CancelledError):
            await beat
        return messages

    messages = {message["kind"]: message for message in asyncio.run(look())}
    assert set(messages) == {"trouble", whole}
    assert messages["trouble"]["of"] == broken
    assert "no faces" in messages["trouble"]["says"]
