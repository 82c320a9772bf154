"""HTML from Python: everything that is not already HTML is escaped, so that nothing from a file can slip in."""

import html
from collections.abc import Iterable, Sequence

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
    """A chapter of the report: heading, one sentence that says what it shows, content."""
    said = (tag("p", lead, cls="lead"),) if lead else ()
    opening = tag("header", tag("h2", title), *said, cls="opening")
    return tag("section", opening, *children, id=anchor)


def figure(drawing: Html, caption: str) -> Html:
    """A drawing with the sentence that says what to see in it."""
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
