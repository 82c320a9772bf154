"""HTML from Python, the page that every report shares, and the chapter that traces a result.

Everything that is not already HTML is escaped, so that no text of a file becomes markup. A page is one file that needs
nothing else, on a screen, a phone or on paper. A result is traced by versions, seeds and the rig file, verbatim.
"""

import base64
import hashlib
import html
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from acquisition.recording import Recording
from acquisition.recording.output import OutputKind, text_output, write_output
from acquisition.recording.rig import rig_sha256
from calibrate.errors import DataError
from calibrate.quantities import significant

VOID = frozenset({"meta", "br", "hr", "link", "col"})  # https://html.spec.whatwg.org/#void-elements


class Html(str):
    """Text that is HTML already; a plain str is text and will be escaped."""

    __slots__ = ()


def escaped(content: str) -> Html:
    """Text as HTML; HTML as it is."""
    return content if isinstance(content, Html) else Html(html.escape(content))


def join(*parts: str) -> Html:
    """Parts one after the other."""
    return Html("".join(escaped(part) for part in parts))


def tag(name: str, /, *children: str, **attributes: str) -> Html:
    """One element. `cls` stands for class, and an underscore in an attribute's name for a hyphen.

    >>> tag("p", "a < b", cls="note")
    '<p class="note">a &lt; b</p>'
    """
    listed = "".join(
        f' {"class" if key == "cls" else key.replace("_", "-")}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    if name in VOID:
        return Html(f"<{name}{listed}>")
    return Html(f"<{name}{listed}>{join(*children)}</{name}>")


def section(anchor: str, title: str, lead: str, *children: str) -> Html:
    """A chapter of the report: heading, one sentence on what it shows, content."""
    said = (tag("p", lead, cls="lead"),) if lead else ()
    opening = tag("header", tag("h2", title), *said, cls="opening")
    return tag("section", opening, *children, id=anchor)


def figure(drawing: Html, caption: str) -> Html:
    """A drawing with the sentence on what to see in it."""
    return tag("figure", drawing, tag("figcaption", caption))


def panels(*figures: Html, cls: str = "panels") -> Html:
    """Figures side by side where the page is wide enough."""
    return tag("div", *figures, cls=cls)


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, numeric: Iterable[int] = (), caption: str = ""
) -> Html:
    """A table; `numeric` columns stand right-aligned. A row shorter than the head lets its last cell span the rest."""
    right = frozenset(numeric)
    cells = [tag("th", text, scope="col", cls="n" if i in right else "t") for i, text in enumerate(head)]
    body = [_row(row, len(head), right) for row in rows]
    title = (tag("caption", caption),) if caption else ()
    inner = tag("table", *title, tag("thead", tag("tr", *cells)), tag("tbody", *body))
    return tag("div", inner, cls="scroll")


def _row(row: Sequence[str], width: int, right: frozenset[int]) -> Html:
    cells: list[Html] = []
    for i, content in enumerate(row):
        rest = width - i if i == len(row) - 1 else 1
        if rest > 1:
            cells.append(tag("td", tag("span", content), cls="t why", colspan=str(rest)))
        else:
            cells.append(tag("th" if i == 0 else "td", content, cls="n" if i in right else "t"))
    return tag("tr", *cells)


def facts(pairs: Iterable[tuple[str, str]]) -> Html:
    """Names and what they are."""
    return tag("dl", *(join(tag("dt", name), tag("dd", value)) for name, value in pairs))


def bullets(items: Iterable[str]) -> Html:
    """A list."""
    return tag("ul", *(tag("li", item) for item in items))


def folded(title: str, *children: str, on_paper: bool = True) -> Html:
    """Content that opens on a click. In print it is open, or with `on_paper` false only named as being in the file."""
    attributes = {} if on_paper else {"cls": "screen-only"}
    return tag("details", tag("summary", title), *children, **attributes)


def halves(*children: str, terse: bool = False) -> Html:
    """Long narrow tables, which paper has room for twice side by side; `terse`: there without their second column."""
    return tag("div", *children, cls="halves terse" if terse else "halves")


def tile(name: str, value: str, says: str) -> Html:
    """A number that is to be seen first: name, number, and one line about it."""
    return tag("div", tag("span", name, cls="name"), tag("b", value), tag("span", says), cls="tile")


# The browser itself refuses anything from outside: https://www.w3.org/TR/CSP3/
POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def page(
    title: str,
    masthead: Html,
    contents: Mapping[str, str],
    chapters: Sequence[Html],
    software: str,
    *,
    kind: str,
    scripts: bool = False,
    running: str = "",
) -> Html:
    """The whole document; `contents` are headings by the anchor of their chapter. `scripts`: those of chapters may run.

    `kind` decides which older page it may replace (`write_page`).

    `running` stands at the head of every printed page, the title where it is empty.

    Each script is allowed by its own hash, so that still nothing runs that a file slipped in.
    """
    style = Html(files("calibrate.report").joinpath("report.css").read_text(encoding="utf-8"))
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        _generator(kind),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY + _allowed(chapters) if scripts else POLICY),
        tag("title", title),
        tag("style", style, _running(running or title)),
    )
    links = (tag("a", heading, href=f"#{anchor}") for anchor, heading in contents.items())
    nav = tag("nav", *links, aria_label="Contents")
    footer = tag("footer", f"Written by {software}. This file needs no network and no other file.")
    body = tag("body", tag("main", masthead, nav, *chapters, footer))
    return join(Html("<!doctype html>\n"), tag("html", head, body, lang="en"), Html("\n"))


def _running(text: str) -> Html:
    """The line at the head of printed pages: a CSS string with all but letters and digits escaped."""
    quoted = "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):06x}" for c in text)
    return Html(f'@page {{ @top-left {{ content: "{quoted}"; font: 8pt sans-serif; color: #4b5763; }} }}')


def _allowed(chapters: Sequence[Html]) -> str:
    """The part of the policy for the scripts of these chapters; pictures that they make of themselves may be saved."""
    found = [script for chapter in chapters for script in re.findall(r"<script>(.*?)</script>", chapter, re.DOTALL)]
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in found)
    listed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return f"; script-src {listed}; img-src data: blob:"


def page_output(kind: str) -> OutputKind:
    """Pages of this kind, as `page` marks them."""
    return text_output(_generator(kind), f"page of the kind '{kind}'")


def write_page(path: Path | str, text: str) -> Path:
    """In place of an older page of the same kind; returns the path. OutputError; DataError where the disk refuses."""
    found = re.search(_generator("(.*?)"), text)
    try:
        return write_output(path, text, page_output(found[1] if found else ""))
    except OSError as error:
        raise DataError(f"{path}: the report cannot be written ({error.strerror}); give another place") from error


def _generator(kind: str) -> Html:
    return tag("meta", name="generator", content=f"calibeam {kind}")


PROVENANCE_TITLE = "Provenance"


def provenance(
    recording: Recording, used: int, used_because: str, identified_by: str, extra: Sequence[tuple[str, str]] = ()
) -> Html:
    """Everything needed to do it again; `used` samples, and why these: "300, of which 290 with both spots"."""
    samples = recording.samples
    span_s = float(samples.column("t_s").max() - samples.column("t_s").min()) if len(samples) else 0.0
    pairs = [
        ("recording", recording.path.name),
        ("state", _state(recording)),
        ("settled samples", f"{len(samples)}, of which {used} {used_because}, over {significant(span_s)} s"),
        ("started (UTC)", recording.started_utc or "not stated"),
        ("recorded by", _by(recording)),
        ("identified by", identified_by),
        *extra,
        ("rig", recording.rig.name),
        ("rig SHA-256", rig_sha256(recording.rig_text)),
        *((f"note: {name}", text) for name, text in recording.notes.items()),
    ]
    rig_text = folded("Rig file, as recorded", tag("pre", recording.rig_text), on_paper=False)
    return section("provenance", PROVENANCE_TITLE, "What it takes to do it again.", facts(pairs), rig_text)


def _state(recording: Recording) -> str:
    return "complete" if recording.complete else "cut short or damaged"


def _by(recording: Recording) -> str:
    software = recording.software or "not stated"
    return f"{software} on {recording.host}" if recording.host else software
