"""Figures of both standards on places whose errors are known beforehand."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from acquisition.recording.rig.schema import PermissibleErrors
from calibrate.errors import DataError
from calibrate.verify import standards
from calibrate.verify.measured_lengths import (
    BallPlaces,
    Judgement,
    Length,
    measured,
)
from calibrate.verify.verify import Verification

RIG = load_rig(Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml")
SHIFTS = np.array([[0.0, 0, 0], [3e-6, 0, 0], [0.0, 4e-6, 0], [0.0, 0, 0], [0.0, 0, 0]])


def ball(count, diameter_m, middle=(0.6, -0.15, 0.2), seed=1):
    """Places of the probe's middle (6 mm) on a sphere of this diameter."""
    way = np.random.default_rng(seed).standard_normal((count, 3))
    return np.array(middle) + 0.5 * (diameter_m + 0.006) * way / np.linalg.norm(way, axis=1, keepdims=True)


def holding(seats=None, touches=None, lengths=(), mpe=None):
    rig = RIG if mpe is None else msgspec.structs.replace(RIG, mpe=mpe)
    return BallPlaces(rig, seats or {}, touches or {}, tuple(lengths))


def by_symbol(figures):
    return {figure.symbol: figure for figure in figures}


def test_size_is_the_diameter_less_the_probes_and_the_calibrated():
    touches = {(1, 0): ball(25, 0.025_004), (2, 0): ball(25, 0.024_990)}
    found = by_symbol(standards.iso10360_12_figures(holding(touches=touches)))["P_Size"]
    assert found.value == pytest.approx(-10e-6, abs=1e-10)
    assert [value for _, value, _ in found.each] == pytest.approx([4e-6, -10e-6], abs=1e-10)
    assert found.judgement is Judgement.CONFORMS
    assert found.complete


def test_form_is_the_span_of_distances_from_the_middle():
    middle, high, low = np.zeros(3), ball(12, 0.025, middle=(0, 0, 0)), ball(12, 0.025_020, middle=(0, 0, 0), seed=2)
    touches = middle + np.concatenate([high, -high, low, -low])  # opposite touches alike: the middle stays
    found = by_symbol(standards.iso10360_12_figures(holding(touches={(1, 0): touches})))["P_Form"]
    assert found.value == pytest.approx(10e-6, rel=1e-3)
    assert not found.complete


def test_location_is_the_ball_round_five_middles():
    touches = {(1, k): ball(5, 0.025, seed=k) + SHIFTS[k - 1] for k in range(1, 6)}
    found = by_symbol(standards.iso10360_12_figures(holding(touches=touches)))["L_Dia"]
    assert found.value == pytest.approx(5e-6, rel=1e-6)
    assert found.taken == found.asked == 5


def test_a_seat_is_judged_by_the_ball_round_its_places():
    found = by_symbol(standards.iso10360_12_figures(holding(seats={1: SHIFTS})))["L_Dia at a seat"]
    assert found.value == pytest.approx(5e-6, rel=1e-6)


def test_a_length_is_judged_by_what_is_permitted_at_its_size():
    mpe = PermissibleErrors(e_uni_m=10e-6, e_uni_per_m=20e-6)
    lengths = [Length(1, 1, 0.6, 0.600_021), Length(2, 2, 0.35, 0.350_018)]
    found = by_symbol(standards.iso10360_12_figures(holding(lengths=lengths, mpe=mpe)))["E_Uni"]
    assert [limit for _, _, limit in found.each] == pytest.approx([22e-6, 17e-6])
    assert found.value == pytest.approx(18e-6)
    assert found.judgement is Judgement.FAILS


def test_scatter_at_a_seat_is_twice_its_standard_deviation():
    places = np.array([[1e-6, 0, 0], [-1e-6, 0, 0], [0, 1e-6, 0], [0, -1e-6, 0]])
    found = by_symbol(standards.b89_4_22_figures(holding(seats={1: places})))["single point (2 s)"]
    assert found.value == pytest.approx(2.0 * np.sqrt(4.0 / 3.0) * 1e-6)
    assert found.also == (("largest distance from the mean", pytest.approx(1e-6)),)


def test_volumetric_names_the_largest_the_range_and_twice_the_rms():
    lengths = [Length(1, k, 0.6, 0.6 + error) for k, error in enumerate((3e-6, -4e-6, 0.0), start=1)]
    found = by_symbol(standards.b89_4_22_figures(holding(lengths=lengths)))["volumetric"]
    assert found.value == pytest.approx(-4e-6)
    assert [value for _, value in found.also] == pytest.approx([7e-6, 2.0 * np.sqrt(25.0 / 3.0) * 1e-6])
    assert (found.taken, found.asked) == (3, 20)


def test_the_effective_diameter_takes_nine_points_and_its_own_series():
    touches = {(1, 0): ball(25, 0.026), (1, 6): ball(9, 0.025_003), (1, 7): ball(9, 0.025_001)}
    found = by_symbol(standards.b89_4_22_figures(holding(touches=touches)))["effective diameter"]
    assert found.value == pytest.approx(3e-6, abs=1e-10)
    assert not found.complete


def test_without_a_limit_nothing_is_judged_and_without_data_nothing_is_reported():
    figures = standards.iso10360_12_figures(holding(seats={1: SHIFTS}, mpe=PermissibleErrors()))
    judgements = {figure.symbol: figure.judgement for figure in figures}
    assert judgements["L_Dia at a seat"] is Judgement.NOT_STATED
    assert judgements["E_Uni"] is Judgement.NOT_MEASURED
    assert "Nothing was judged" in Verification(figures, 5).sentence


def test_the_sentence_names_what_fails():
    mpe = PermissibleErrors(single_point_m=1e-9, volumetric_m=1.0)
    held = holding(seats={1: SHIFTS}, lengths=[Length(1, 1, 0.6, 0.6)], mpe=mpe)
    found = Verification(standards.b89_4_22_figures(held), 7)
    assert found.sentence.startswith("Does not conform: single point (2 s)")
    assert len(found.judged) == 2


class Straight:
    """An arm whose probe is where the first three joints say."""

    def tip_m(self, q_rad):
        return q_rad[:, :3]


def table(**columns):
    rows = len(next(iter(columns.values())))
    joints = {f"q{i}_rad": np.zeros(rows) for i in range(4, 7)}
    return Samples({"t_s": np.arange(rows, dtype=float), **joints, **columns}, 6)


def test_places_are_sorted_by_artefact_and_bars_by_where_they_stood():
    nan = np.nan
    samples = table(
        q1_rad=np.array([0.1, 0.2, 0.0, 0.0, 0.0, 0.0, 0.3]),
        q2_rad=np.array([0.0, 0.0, 0.0, 0.6, 0.0, 0.6, 0.0]),
        q3_rad=np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.2, 0.0]),
        seat=np.array([1.0, 1, nan, nan, nan, nan, nan]),
        bar=np.array([nan, nan, 1.0, 1, 1, 1, nan]),
        bar_end=np.array(["", "", "a", "b", "a", "b", ""]),
        sphere=np.array([nan, nan, nan, nan, nan, nan, 2.0]),
        series=np.array([nan, nan, nan, nan, nan, nan, 3.0]),
    )
    found = measured(samples, RIG, Straight())
    np.testing.assert_array_equal(found.seats[1][:, 0], [0.1, 0.2])
    assert list(found.touches) == [(2, 3)]
    assert [length.position for length in found.lengths] == [1, 2]
    assert found.lengths[0].error_m == pytest.approx(0.6 - RIG.bars[1].length_m)


def test_bars_that_cross_in_their_middle_stand_in_two_places_and_one_turned_round_in_one():
    ends = np.array([[-0.3, 0, 0], [0.3, 0, 0], [0, -0.3, 0], [0, 0.3, 0], [0.3, 0.01, 0], [-0.3, 0.01, 0]])
    samples = table(**{f"q{i + 1}_rad": ends[:, i] for i in range(3)}, bar=np.ones(6), bar_end=np.array(["a", "b"] * 3))
    assert [length.position for length in measured(samples, RIG, Straight()).lengths] == [1, 2, 1]


def test_a_flat_series_of_touches_is_left_out_and_said_and_the_others_count():
    good, turn = ball(25, 0.025), np.linspace(0.0, 6.0, 25)
    flat = np.array([0.6, -0.15, 0.2]) + 0.01 * np.stack([np.cos(turn), np.sin(turn), 1e-3 * np.cos(9 * turn)], axis=1)
    places = np.concatenate([good, flat])
    samples = table(
        **{f"q{i + 1}_rad": places[:, i] for i in range(3)}, sphere=np.repeat([1.0, 2.0], 25), series=np.zeros(50)
    )
    found = measured(samples, RIG, Straight())
    assert found.left_out == (
        "sphere 2, series 0 left out: the touches lie in one plane and show no sphere; touch it all round",
    )
    assert by_symbol(standards.iso10360_12_figures(found))["P_Size"].taken == 1
    assert "left out" in Verification(standards.iso10360_12_figures(found), 50, found.left_out).sentence


def test_a_recording_without_artefacts_is_refused():
    empty = table(q1_rad=np.zeros(2), q2_rad=np.zeros(2), q3_rad=np.zeros(2))
    with pytest.raises(DataError, match=r"nothing to verify by.*--verify"):
        measured(empty, RIG, Straight())
