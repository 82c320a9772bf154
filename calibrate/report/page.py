"""One HTML file that needs nothing else, on a screen, a phone or on paper: the shell that every report shares."""

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from calibrate.errors import DataError
from calibrate.report.elements import Html, join, tag

# The browser itself refuses anything from outside: https://www.w3.org/TR/CSP3/
POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def page(
    title: str,
    masthead: Html,
    contents: Mapping[str, str],
    chapters: Sequence[Html],
    software: str,
    *,
    scripts: bool = False,
    running: str = "",
) -> Html:
    """The whole document; `contents` are headings by the anchor of their chapter. `scripts`: those of chapters may run.

    `running` stands at the head of every printed page, the title where it is empty.

    Each script is allowed by its own hash, so that still nothing runs that a file slipped in.
    """
    style = Html(files("calibrate.report").joinpath("report.css").read_text(encoding="utf-8"))
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
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


def write_page(path: Path | str, text: str) -> Path:
    """Over what may be there; returns the path. DataError where it cannot be written."""
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: the report cannot be written ({error.strerror}); give another place") from error
    return Path(path)
