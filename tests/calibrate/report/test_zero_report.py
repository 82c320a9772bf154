"""The report: whole, self-contained, honest about what is not determined, and quiet in a browser."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from calibrate.identification.evidence_record import evidence_fields
from calibrate.report.zero_report import report_html, write_report

VOID = {"meta", "br", "hr", "img", "input", "link"}


@pytest.fixture(scope="module")
def page(recorded, identified) -> str:
    return report_html(recorded, identified.zeros, point_constraint=identified.four_poses)


class Balance(HTMLParser):
    """Fails on a tag that is closed but not open."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None: ...

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", re.sub(r"<(style|svg).*?</\1>", " ", page, flags=re.DOTALL)))


def test_proofs_of_the_same_fit_have_a_chapter_where_they_were_made(recorded, identified, page):
    proved = evidence_fields(identified.proved.evidence)
    told = text_of(report_html(recorded, identified.zeros, proved=proved))
    assert all(proof.split in told for proof in proved["proofs"])
    assert len(proved["proofs"]) >= 2
    assert "drawn evenly between the joint limits" in told or proved["free_space"].says in told
    assert 'href="#proofs"' not in page


def test_observability_and_alarms_stand_beside_the_proofs(recorded, identified):
    proved = evidence_fields(identified.proved.evidence)
    told = text_of(report_html(recorded, identified.zeros, proved=proved, alarms=["chi-square is above the noise"]))
    calm = text_of(report_html(recorded, identified.zeros, proved=proved))
    indices = [f"O{k}" for k in range(1, 6)]
    assert " ".join(indices) in told
    assert f"the {proved['observability'].parameters} parameters" in told
    assert "chi-square is above the noise" in told
    assert "raises no alarm" in calm
    assert "raises no alarm" not in told


def test_every_element_is_closed(page: str) -> None:
    balance = Balance()
    balance.feed(page)
    assert balance.open == []


def test_nothing_is_fetched_from_anywhere(page: str) -> None:
    addresses = re.findall(r"""(?:src|href)\s*=\s*["']([^"'#][^"']*)["']""", page)
    assert addresses == []
    assert not re.search(r"@import|url\(\s*[\"']?(?!#)", page)
    assert "<script" not in page
    assert len(page) < 2_000_000


def test_a_hostile_name_is_text(page: str) -> None:
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_every_zero_is_told_and_undetermined_ones_without_a_number(page: str, identified) -> None:
    rows = re.findall(r"<tr>(.*?)</tr>", page, flags=re.DOTALL)
    for zero in identified.zeros.zeros:
        own = [text_of(row).strip() for row in rows if text_of(row).strip().startswith(f"J{zero.joint} ")]
        assert own
        if zero.value_rad is None:
            assert "not determined" in own[0]
            assert not re.search(r"[−-]?\d+\.\d{3,}", own[0])
        else:
            assert re.search(r"\d+\.\d{3,}", own[0])


def test_all_chapters_are_there(page: str) -> None:
    text = text_of(page)
    for chapter in (
        "The rig",
        "Spots on the faces",
        "Laser centring",
        "Residuals and noise",
        "Joint zeros and rank",
        "Four-pose point constraint",
        "What the data cannot see",
        "Provenance",
    ):
        assert chapter in text
    assert page.count("<svg") >= 9


def test_rows_left_out_of_the_fit_are_named(page: str, recorded, identified) -> None:
    assert "left out of the fit" not in text_of(page)
    told = text_of(report_html(recorded, identified.zeros, left_out=["row 7, psd1_x_m: 5 mm < off; check it"]))
    assert "left out of the fit" in told
    assert "row 7, psd1_x_m: 5 mm &lt; off; check it" in told


def test_chromium_shows_it_without_a_word_on_the_console(recorded, identified, tmp_path: Path) -> None:
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("no chromium on the PATH (Debian: apt-get install chromium); the page is not looked at")
    path = write_report(tmp_path / "report.html", recorded, identified.zeros, point_constraint=identified.four_poses)
    command = [
        browser,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--enable-logging=stderr",
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--screenshot={tmp_path / 'shot.png'}",
        path.as_uri(),
    ]
    said = subprocess.run(command, capture_output=True, text=True, timeout=90, check=True).stderr
    assert "CONSOLE" not in said
    assert (tmp_path / "shot.png").stat().st_size > 20_000
