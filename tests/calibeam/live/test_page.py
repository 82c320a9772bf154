"""The page as it is served: an address that opens it, messages that arrive, an end that frees the port."""

import json
import re
import threading
from dataclasses import replace

import pytest
from msgspec import structs
from websockets.sync.client import ClientConnection, connect

from acquisition.recording.rig import Rig
from acquisition.recording.rig.schema import Live
from benchmarks.live_feed import LivingRig
from calibeam.live.health import Latest
from calibeam.live.page import LivePage, PageAddress, PageError, live_page
from calibeam.live.stopping import ON_THE_WAY
from drivers.clock import SystemClock

ANY_PORT = PageAddress(port=0)


def listening(page: LivePage) -> ClientConnection:
    host = page.url.removeprefix("http://").partition("/")[0]
    return connect(f"ws://{host}/feed", origin=f"http://{host}", open_timeout=10.0)  # pyright: ignore[reportArgumentType]


def test_every_kind_of_message_arrives(rig) -> None:
    clock = SystemClock()
    with live_page(rig, clock, ANY_PORT) as page, listening(page) as socket:
        living = LivingRig(rig, page.feed, clock)
        kinds: dict[str, dict] = {}
        while len(kinds) < 3 or kinds["now"]["faces"] is None:
            living.send(0.0)
            message = json.loads(socket.recv(timeout=10.0))
            kinds[message["kind"]] = message
            socket.send("1")
    assert set(kinds) == {"rig", "state", "now"}


def test_a_page_that_takes_nothing_gets_nothing_more(rig) -> None:
    with live_page(rig, SystemClock(), ANY_PORT) as page, listening(page) as slow, listening(page) as quick:
        for _ in range(20):
            quick.recv(timeout=10.0)
            quick.send("1")
        held = [json.loads(slow.recv(timeout=10.0)) for _ in range(ON_THE_WAY)]
        with pytest.raises(TimeoutError):
            slow.recv(timeout=0.0)
        slow.send("1")
        after = json.loads(slow.recv(timeout=10.0))
    newest_before = max(message.get("number", 0) for message in held)
    assert after["kind"] == "state" or after["number"] > newest_before + 3


def test_off_loopback_a_token_is_made_at_random(rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("calibeam.live.page.is_loopback", lambda host: False)  # nothing but loopback is bound here
    urls: list[str] = []
    for _ in range(2):
        with live_page(rig, SystemClock(), ANY_PORT) as page:
            urls.append(page.url)
    tokens = [url.partition("?token=")[2] for url in urls]
    assert all(re.fullmatch(r"[\w-]{24}", token) for token in tokens)
    assert tokens[0] != tokens[1]


def test_a_port_that_is_taken_is_reported_and_free_again_afterwards(rig, own_address) -> None:
    with live_page(rig, SystemClock(), own_address) as page:
        port = int(page.url.rpartition(":")[2].strip("/"))
        with (
            pytest.raises(PageError, match=rf"{re.escape(own_address.host)}:{port}.*choose another port"),
            live_page(rig, SystemClock(), replace(own_address, port=port)),
        ):
            pass
    with live_page(rig, SystemClock(), replace(own_address, port=port)):
        pass


def test_an_address_of_another_machine_is_reported(rig) -> None:
    with pytest.raises(PageError, match="live page"), live_page(rig, SystemClock(), PageAddress("192.0.2.1", 0)):
        pass


def test_a_picture_that_cannot_be_made_is_reported_and_the_beat_goes_on(rig) -> None:
    class BrokenError(Exception):
        pass

    class BrokenView:
        @property
        def faces(self) -> None:
            raise BrokenError("no faces")

    clock = SystemClock()
    with live_page(rig, clock, ANY_PORT) as page, listening(page) as socket:
        assert isinstance(page.feed, Latest)
        living = LivingRig(rig, page.feed, clock)
        view, page.feed.view = page.feed.view, BrokenView()  # pyright: ignore[reportAttributeAccessIssue]
        seen: list[str] = []
        while "trouble" not in seen or seen[-1] != "now":
            living.send(0.0)
            seen.append(json.loads(socket.recv(timeout=10.0))["kind"])
            socket.send("1")
            if seen[-1] == "trouble":
                page.feed.view = view


@pytest.fixture
def strict(rig) -> Rig:
    return structs.replace(rig, live=Live(stop_without_page_s=0.2))


def test_where_the_rig_says_so_the_last_page_that_goes_stops_the_arm(strict) -> None:
    stopped = threading.Event()
    with live_page(strict, SystemClock(), ANY_PORT) as page:
        page.feed.stops_by(stopped.set)
        with listening(page) as socket:
            socket.recv(timeout=10.0)
            socket.send("1")
        assert stopped.wait(10.0)
