"""HTML from Python: text is escaped once, HTML never again."""

from calibrate.report.elements.html import (
    Html,
    join,
    table,
    tag,
)


def test_text_is_escaped_and_html_is_not() -> None:
    assert tag("p", "a < b", tag("b", "&")) == "<p>a &lt; b<b>&amp;</b></p>"


def test_attributes_are_escaped() -> None:
    assert tag("a", "x", href='"><script>') == '<a href="&quot;&gt;&lt;script&gt;">x</a>'


def test_joined_parts_are_html() -> None:
    assert isinstance(join("<", Html("<br>")), Html)
    assert join("<", Html("<br>")) == "&lt;<br>"


def test_the_last_cell_of_a_short_row_spans_the_rest() -> None:
    assert 'colspan="2"' in table(("Joint", "zero", "sigma"), [("J1", "not determined")])
