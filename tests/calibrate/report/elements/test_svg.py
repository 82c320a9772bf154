"""Figures inside the page: own ids, the page's colours and font, nothing that needs the network."""

import re

from matplotlib.figure import Figure

from calibrate.report.elements.html import Html
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import Tone


def clipped_line(figure: Figure) -> None:
    axes = figure.add_subplot()
    axes.plot([0.0, 1.0], [0.0, 2.0], "o-", color=Tone.BEAM.value)
    axes.set(xlim=(0.2, 0.8), title="A title of $5")


def test_two_figures_share_no_id() -> None:
    first, second = (set(re.findall(r'\bid="([^"]+)"', drawn(n, "x", 3, 2, clipped_line))) for n in ("a", "b"))
    assert first
    assert not first & second


def test_every_reference_points_into_its_own_figure() -> None:
    svg = drawn("a", "x", 3, 2, clipped_line)
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', svg))
    assert used
    assert used <= set(re.findall(r'\bid="([^"]+)"', svg))


def test_colours_are_those_of_the_page() -> None:
    svg = drawn("a", "x", 3, 2, clipped_line)
    assert "var(--beam)" in svg
    assert not [tone for tone in Tone if tone.value in svg]


def test_text_stays_text_in_the_font_of_the_page() -> None:
    svg = drawn("a", "x", 3, 2, clipped_line)
    assert "A title of $5" in svg
    assert "var(--sans)" in svg
    assert "DejaVu" not in svg


def test_nothing_names_the_network() -> None:
    assert "http" not in drawn("a", "x", 3, 2, clipped_line)


def test_what_it_says_to_a_screen_reader_is_escaped() -> None:
    assert 'aria-label="a &lt;b&gt; &quot;c&quot;"' in drawn("a", 'a <b> "c"', 3, 2, clipped_line)


def test_the_same_figure_gives_the_same_bytes() -> None:
    assert drawn("a", "x", 3, 2, clipped_line) == drawn("a", "x", 3, 2, clipped_line)


def test_it_is_html_that_is_not_escaped_again() -> None:
    assert isinstance(drawn("a", "x", 3, 2, clipped_line), Html)
