"""The page says who drifts, who shares a cause, what failed; it needs nothing else and takes any name."""

import re

import msgspec
import numpy as np
import pytest
from msgspec import structs

from calibeam.fleet.fleet_page import LISTED, fleet_html
from calibeam.fleet.row import Cause, Outcome, Row, Zero
from calibeam.fleet.run import RunResult
from calibeam.fleet.summary import Fleet, causes, shared_words
from calibeam.printing.fleet import fleet_record

DAYS = ("2025-01-01", "2025-07-01", "2026-01-01", "2026-07-01")
FOUND = Cause("joint3.angle", "q3", "harmonic", "encoder-eccentricity", 0.99, 0.8, "…")
OTHER = Cause("link2.tilt", "q2", "harmonic", "axis-wobble", 0.99, 0.8, "…")


def session(robot, day, zero_rad, found=(), verdict="mismatch"):
    zeros = (Zero(1, None, None, "not seen", 0.0), Zero(2, zero_rad, 2e-5, "determined", 0.0))
    name = f"{robot}/{day}.mcap"
    known = {"trust": "yes", "started_utc": day, "samples": 60, "held_out_after_m": 1e-5, "verdict": verdict}
    return Row(
        f"/{name}", name, name, 1, 1, Outcome.IDENTIFIED, "calibeam 1", robot=robot, zeros=zeros, causes=found, **known
    )


@pytest.fixture
def fleet():
    rng = np.random.default_rng(1)
    rows = [
        session(robot, day, 2e-5 * rng.standard_normal() + (4e-4 * k if robot == "<b>7" else 0.0), found)
        for robot, found in (("<b>7", (FOUND,)), ("8", (FOUND, OTHER)), ("9", ()))
        for k, day in enumerate(DAYS)
    ]
    torn = Row("/x/torn.mcap", "x/torn.mcap", "", 1, 1, Outcome.FAILED, "calibeam 1", error="torn <before> the rig")
    return Fleet((*rows, torn))


def test_a_recording_that_was_cut_short_is_marked_and_stands_for_no_robot_that_has_a_whole_one(fleet):
    torn = structs.replace(session("9", "2026-11-01", 0.0), complete=False)
    alone = structs.replace(session("10", "2026-11-01", 0.0), complete=False)
    more = Fleet((*fleet.rows, torn, alone))
    assert {row.robot: row.started_utc for row in more.newest()}["9"] == DAYS[-1]
    assert alone in more.newest()
    assert more.torn == (torn, alone)
    assert fleet_html(more, "hall 3").count("cut short or damaged") == 2


def test_the_page_names_the_robot_that_drifts_the_cause_that_is_shared_and_the_file_that_failed(fleet):
    page = fleet_html(fleet, "hall 3")
    assert "1 of 3 robots drifts" in page
    assert "&lt;b&gt;7: the zero of joint 2 drifts by" in page
    assert "encoder-eccentricity at joint3.angle: 2 of 3 robots" in page
    assert "torn &lt;before&gt; the rig" in page
    assert "Holm" in page


def test_two_recordings_of_one_day_are_one_date(fleet):
    drifting = fleet.drifting[0].series
    again = session(drifting.robot, DAYS[0], 0.0)
    rows = (*fleet.rows, msgspec.structs.replace(again, path="/again", name="again", sha256="again"))
    twice = Fleet(rows)
    assert fleet_record(RunResult(rows, 0, 0, 0, stopped=False), twice, "", "")["drifts"][0]["dates"] == len(DAYS)
    cells = re.search(r"<tr>(?:(?!</tr>).)*>drifts<.*?</tr>", fleet_html(twice, "hall 3"), re.DOTALL)
    assert cells is not None
    assert f">{len(DAYS)}<" in cells[0]


def test_the_page_needs_nothing_else(fleet):
    page = fleet_html(fleet, "hall 3")
    assert not re.search(r'(?:src|href)="(?!#)', page)
    assert "url(http" not in page
    assert "<b>7" not in page


def test_ids_stand_once(fleet):
    ids = re.findall(r'\bid="([^"]+)"', fleet_html(fleet, "hall 3"))
    assert len(ids) == len(set(ids))


def test_causes_are_counted_by_robots_and_recordings(fleet):
    first, second = causes(fleet.rows)
    assert (first.where, first.count, first.robots["<b>7"], first.robots["9"]) == ("joint3.angle", 2, (4, 4), (0, 4))
    assert (second.physics, second.count) == ("axis-wobble", 1)
    assert shared_words(first) == "encoder-eccentricity at joint3.angle: 2 of 3 robots"
    assert fleet.shared == (first,)


def test_a_fleet_of_failures_has_its_page():
    lost = [Row(f"/{i}", str(i), "", 1, 1, Outcome.LOST, "c", error="gone") for i in range(LISTED + 5)]
    page = fleet_html(Fleet(tuple(lost)), "nothing")
    assert "drift is not determined" in page
    assert "Rows that are only in fleet.parquet: 5." in page
