"""A drift is said where there is one, and hardly ever where there is none."""

import numpy as np
import pytest

from calibeam.fleet.drift import (
    FAMILY,
    Series,
    all_series,
    common_scatter,
    find_drifts,
    find_drifts_in,
    fit_line,
    holm,
    year_of,
)
from calibeam.fleet.row import Outcome, Row, Zero

SIGMA = 2e-5


def series(year, zero_rad, sigma_rad=SIGMA, robot="r", joint=2):
    year = np.asarray(year, dtype=float)
    return Series(robot, joint, year, np.asarray(zero_rad, dtype=float), np.full(len(year), sigma_rad))


def row(robot, date, zero_rad, sigma_rad=SIGMA, drawn_rad=0.0, **fields):
    known = {"trust": "yes", "started_utc": date, "sha256": f"{robot}{date}"} | fields
    sha256 = known.pop("sha256")
    zeros = (Zero(1, None, None, "not seen", 0.0), Zero(2, zero_rad, sigma_rad, "determined", drawn_rad))
    path = f"/{robot}/{date}"
    return Row(path, path[1:], sha256, 1, 1, Outcome.IDENTIFIED, "", robot=robot, zeros=zeros, **known)


def test_points_on_a_line_give_the_line():
    year = np.array([2020.0, 2020.5, 2022.0])
    found = fit_line(series(year, 1e-3 + 3e-4 * (year - 2020.0)))
    assert found.slope_rad_year == pytest.approx(3e-4)
    assert found.zero_rad == pytest.approx(1e-3)
    assert found.change_rad == pytest.approx(6e-4)
    assert found.sigma_rad_year == pytest.approx(SIGMA / np.sqrt(np.sum((year - year.mean()) ** 2)))


def test_one_session_gone_wrong_is_no_drift():
    rng = np.random.default_rng(4)
    zero = SIGMA * rng.standard_normal(8)
    zero[-1] += 60.0 * SIGMA
    assert fit_line(series(np.arange(8.0), zero)).p > 0.01


def test_scatter_beyond_the_stated_sigma_widens_the_interval():
    year, zero = np.arange(6.0), 20.0 * SIGMA * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    found = fit_line(series(year, zero))
    assert found.sigma_rad_year > 5.0 * SIGMA / np.sqrt(np.sum((year - 2.5) ** 2))
    assert found.low_rad_year < 0.0 < found.high_rad_year


def test_what_all_zeros_scatter_is_what_their_sigmas_are_worth():
    rng, year = np.random.default_rng(3), np.arange(4.0)
    for scatter, expected in ((3.0, 3.0), (0.3, 1.0)):
        fleet = [series(year, year * 1e-3 + scatter * SIGMA * rng.standard_normal(4)) for _ in range(200)]
        assert common_scatter(fleet) == pytest.approx(expected, rel=0.15)
    assert common_scatter([]) == 1.0


@pytest.mark.parametrize("scatter", [1.0, 3.0])
def test_of_fleets_without_drift_at_most_five_in_a_hundred_show_one(scatter):
    rng, fleets, said = np.random.default_rng(8), 100, 0
    for _ in range(fleets):
        dates = [np.sort(rng.uniform(0.0, 3.0, rng.integers(3, 7))) for _ in range(12)]
        still = [series(year, scatter * SIGMA * rng.standard_normal(len(year))) for year in dates]
        said += any(one.significant for one in find_drifts_in(still).lines)
    assert said <= FAMILY * fleets + 3.0 * np.sqrt(FAMILY * (1.0 - FAMILY) * fleets)


def test_the_robot_that_drifts_is_found_among_many():
    rng = np.random.default_rng(5)
    days = ("2025-01-01", "2025-07-01", "2026-01-01", "2026-07-01")
    rows = [
        row(f"r{robot}", day, SIGMA * rng.standard_normal() + (5e-4 * k / 2 if robot == 3 else 0.0))
        for robot in range(20)
        for k, day in enumerate(days)
    ]
    found = [d for d in find_drifts(rows).lines if d.significant]
    assert [(d.series.robot, d.series.joint) for d in found] == [("r3", 2)]
    assert found[0].low_rad_year < 5e-4 < found[0].high_rad_year


def test_two_dates_copies_and_numbers_of_no_trust_are_no_series():
    rows = [row("r", day, 0.0) for day in ("2025-01-01", "2026-01-01")]
    assert find_drifts(rows).lines == ()
    copy = row("r", "2026-06-01", 0.0, sha256=rows[0].sha256)
    untrusted = row("r", "2026-07-01", 1.0, trust="no")
    undated = row("r", "", 1.0)
    assert find_drifts([*rows, copy, untrusted, undated]).lines == ()
    assert [len(s.year) for s in all_series([*rows, copy, untrusted, undated])] == [2]


def test_a_zero_that_was_written_into_the_rig_file_is_no_step():
    rows = [row("r", "2024-01-01", 3e-3), row("r", "2025-01-01", 3e-3), row("r", "2026-01-01", 0.0, drawn_rad=3e-3)]
    turned = row("r", "2027-01-01", 3e-3, drawn_rad=-2.0 * np.pi)
    (found,) = all_series([*rows, turned])
    np.testing.assert_allclose(found.zero_rad, 3e-3, atol=1e-12)


def test_holm_stops_at_the_first_that_could_be_chance():
    assert holm([0.02, 0.001, 0.5]) == [True, True, False]
    assert holm([0.03, 0.001, 0.5]) == [False, True, False]
    assert holm([0.02, 0.03, 0.04]) == [False, False, False]
    assert holm([]) == []


def test_dates_with_and_without_a_time_of_day():
    whole = year_of("2026-01-01")
    assert whole == pytest.approx(56.0, abs=0.01)
    assert year_of("2026-01-01T12:00:00+00:00") == pytest.approx(whole + 0.5 / 365.25)
    assert year_of("") is None
    assert year_of("last summer") is None
