"""Who may look and press: names, tokens, and pages of other sites. A real server, asked without a browser's manners."""

from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from calibeam.live.app import is_loopback
from calibeam.live.page import LivePage, PageAddress, live_page
from drivers.clock import SystemClock

TOKEN = "right-token"
OTHERS = [None, "http://evil.example", "http://127.0.0.1:1", "null"]


class Visitor:
    """Asks a page for things; `headers` may say what no browser would."""

    def __init__(self, page: LivePage) -> None:
        self.host = page.url.removeprefix("http://").partition("/")[0]
        self.origin = f"http://{self.host}"
        self.feed = page.feed

    def ask(self, method: str, path: str, **headers: str | None) -> HTTPResponse:
        line = HTTPConnection(self.host, timeout=10.0)
        given = {key: value for key, value in headers.items() if value is not None}
        try:
            line.putrequest(method, path, skip_host="host" in given)
            for key, value in given.items():
                line.putheader(key, value)
            line.endheaders()
            answer = line.getresponse()
            answer.read()
            return answer
        finally:
            line.close()

    def status(self, method: str, path: str, **headers: str | None) -> int:
        return self.ask(method, path, **headers).status

    def listen(self, path: str = "/feed", origin: str | None = None, **headers: str) -> str:
        """The first message of the feed."""
        where = f"ws://{self.host}{path}"
        with connect(where, origin=origin, additional_headers=headers, open_timeout=10.0) as socket:  # pyright: ignore[reportArgumentType]
            return str(socket.recv(timeout=10.0))


def served(rig, token: str | None) -> Iterator[Visitor]:
    with live_page(rig, SystemClock(), PageAddress(port=0, token=token)) as page:
        yield Visitor(page)


@pytest.fixture(scope="module")
def visitor(rig) -> Iterator[Visitor]:
    yield from served(rig, None)


@pytest.fixture(scope="module")
def stranger(rig) -> Iterator[Visitor]:
    """Of a page that asks for a token."""
    yield from served(rig, TOKEN)


@pytest.fixture
def pressed(visitor, stranger) -> Iterator[list[str]]:
    """What STOP has stopped."""
    stopped: list[str] = []
    visitor.feed.stops_by(lambda: stopped.append("open"))
    stranger.feed.stops_by(lambda: stopped.append("guarded"))
    yield stopped
    visitor.feed.stops_by(None)
    stranger.feed.stops_by(None)


def test_the_page_and_all_that_it_loads_come_from_here(visitor) -> None:
    page = visitor.ask("GET", "/")
    assert page.status == 200
    assert "default-src 'none'; script-src 'self'; style-src 'self'" in (
        page.getheader("content-security-policy") or ""
    )
    assert page.getheader("x-content-type-options") == "nosniff"
    assert {visitor.status("GET", f"/static/{name}") for name in ("live.css", "main.js", "icon.svg")} == {200}
    assert visitor.status("GET", "/static/../app.py") == 404
    assert visitor.status("GET", "/static/%2e%2e/app.py") == 404


@pytest.mark.parametrize(("name", "status"), [("evil.example", 403), ("localhost", 200), ("[::1]", 200), ("", 403)])
def test_only_names_of_this_machine_are_answered(visitor, name, status) -> None:
    assert visitor.status("GET", "/", host=f"{name}:8765") == status


@pytest.mark.parametrize("origin", OTHERS)
def test_a_page_of_another_site_neither_listens_nor_stops(visitor, pressed, origin) -> None:
    assert visitor.status("POST", "/stop", origin=origin) == 403
    with pytest.raises(InvalidStatus):
        visitor.listen(origin=origin)
    assert not pressed


def test_the_page_itself_listens_and_stops(visitor, pressed) -> None:
    assert '"kind":"rig"' in visitor.listen(origin=visitor.origin)
    assert visitor.status("POST", "/stop", origin=visitor.origin) == 200
    assert pressed == ["open"]


def test_a_stop_is_no_link(visitor, pressed) -> None:
    assert visitor.status("GET", "/stop") == 405
    assert not pressed


@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong", "?token=right-toke", "?token=%C3%A4"])
def test_without_the_token_nothing_is_shown(stranger, pressed, query) -> None:
    assert stranger.status("GET", f"/{query}") == 401
    assert stranger.status("GET", f"/static/main.js{query}") == 401
    assert stranger.status("POST", f"/stop{query}", origin=stranger.origin) == 401
    with pytest.raises(InvalidStatus):
        stranger.listen(f"/feed{query}", origin=stranger.origin)
    assert not pressed


def test_the_token_goes_from_the_address_into_a_cookie(stranger, pressed) -> None:
    answer = stranger.ask("GET", f"/?token={TOKEN}")
    assert (answer.status, answer.getheader("location")) == (303, "/")
    kept = answer.getheader("set-cookie") or ""
    assert "httponly" in kept.lower()
    assert "samesite=lax" in kept.lower()  # else a link in a mail leads to 401: its redirect comes without the cookie
    crumb = kept.partition(";")[0]
    assert stranger.status("GET", "/", cookie=crumb) == 200
    assert '"kind":"rig"' in stranger.listen(origin=stranger.origin, cookie=crumb)
    assert stranger.status("POST", "/stop", origin=stranger.origin, cookie=crumb) == 200
    assert pressed == ["guarded"]


@pytest.mark.parametrize("origin", OTHERS)
def test_with_the_token_another_site_is_still_refused(stranger, pressed, origin) -> None:
    assert stranger.status("POST", f"/stop?token={TOKEN}", origin=origin) == 403
    assert not pressed


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_loopback_needs_no_token(host) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "10.0.0.1", "::", "box"])
def test_every_other_address_does(host) -> None:
    assert not is_loopback(host)
