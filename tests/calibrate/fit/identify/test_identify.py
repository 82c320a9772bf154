"""Sessions of every instrument identify the arm that made them, and say what they cannot."""

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.errors import DataError
from calibrate.fit.accuracy import Alarm
from calibrate.fit.identify.identify import identify
from calibrate.fit.solvers import Status
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.predict import Predictor, predict
from tests.calibrate.fit.identify.conftest import BAR_M, Session, table

TRACKER_M = 1e-5


def run(rig, samples, **options):
    return identify(rig, samples, rng=np.random.default_rng(0), **options)


def predictor(rig, result):
    values = {p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)}
    return Predictor(rig, values, result.about, tuple(i.name for i in result.instruments))


def tracked(rig, session, n=150, noise_m=TRACKER_M):
    rig = msgspec.structs.replace(rig, noise=msgspec.structs.replace(rig.noise, position_m=noise_m))
    q = session.readings(n)
    return rig, table(q, **session.positions(q, noise_m))


def test_a_tracker_of_unknown_place_predicts_unseen_poses_to_a_fraction_of_its_noise(rig, session):
    rig, samples = tracked(rig, session)
    result = run(rig, samples)
    q = session.readings(100)
    truth = session.positions(q, 0.0)
    predicted = predict(predictor(rig, result), table(q, **truth))
    error = np.stack([predicted[f"r_{c}"] for c in truth])
    assert np.sqrt(np.mean(error**2)) < 0.6 * TRACKER_M
    assert result.blunders == ()
    assert result.stated_noise.alarm is Alarm.NONE


@pytest.fixture(scope="module")
def without_tolerance(rig, ur5e_truth):
    """A session before a tracker, and its answer by a rig file without tolerances."""
    session = Session(ur5e_truth(np.random.default_rng(5), zero_max=5e-3))
    rig, samples = tracked(rig, session, n=250)
    return session, run(msgspec.structs.replace(rig, tolerance=None), samples)


def test_links_without_tolerance_are_free_and_the_noise_is_found(without_tolerance):
    _, result = without_tolerance
    (noise,) = result.noise
    assert (noise.source, noise.found) == ("position", pytest.approx(TRACKER_M, rel=0.15))
    random, last = result.held_out
    assert (random.split, last.split) == ("random 20% of the rows", "last 20% of the session")
    for unseen in (random, last):
        assert unseen.observations == 50
        assert unseen.rms_distance_before_m > 5e-4
        assert unseen.rms_distance_after_m < 2.2 * TRACKER_M


def test_what_is_said_with_a_sigma_is_true(rig, without_tolerance):
    session, result = without_tolerance
    lines = {e.name: e for e in result.estimates if e.value is not None}
    truth = {f"link{i + 1}.length": row[1] - rig.arm.joints[i].a_m for i, row in enumerate(session.truth.links)}
    for name in ("link2.length", "link3.length"):
        assert abs(lines[name].value - truth[name]) < 4.0 * lines[name].sigma
        assert lines[name].sigma < 3e-5
    for name in ("joint1.zero", "device.yaw", "link1.offset", "device.z", "link2.offset"):
        assert name not in lines
    assert result.status is Status.RANK_DEFICIENT


def test_a_drawing_is_not_given_back_as_a_finding(rig, session):
    rig, _ = tracked(rig, session)
    q = session.readings(150)
    q[:, 4:] = 0.4  # two joints that never move show nothing of what is behind them
    result = run(rig, table(q, **session.positions(q, TRACKER_M)), held_out_share=0.0)
    why = {e.name: e.why for e in result.estimates}
    assert why["link6.twist"].startswith("known from its assumed tolerance only")
    assert why["link2.length"] is None


def test_an_understated_noise_is_an_alarm(rig, session):
    rig, samples = tracked(rig, session, noise_m=5e-5)
    rig = msgspec.structs.replace(rig, noise=msgspec.structs.replace(rig.noise, position_m=5e-6))
    assert run(rig, samples).stated_noise.alarm is Alarm.ABOVE_STATED


def test_wire_alone_is_fitted_and_its_drum_found(rig, session):
    q = session.readings(200)
    drum = np.array([1.1, 0.9, 0.2])
    wire = np.linalg.norm(session.tips(q) - drum, axis=1) + session.rng.normal(0.0, 2e-5, 200)
    result = run(rig, table(q, wire_m=wire))
    (instrument,) = result.instruments
    assert (instrument.name, instrument.observations) == ("wire", 200)
    assert instrument.rms_distance_after_m < 3e-5 < instrument.rms_distance_before_m
    place = predictor(rig, result).T_base_device[:3, 3]
    assert np.hypot(*place[:2]) == pytest.approx(np.hypot(*drum[:2]), abs=1e-3)  # a turn about axis 1 is nobody's
    assert place[2] == pytest.approx(drum[2], abs=1e-3)


def seated(session, cones, each):
    q, good = session.reaching(np.repeat(cones, each, axis=0))
    return q[good], np.repeat(np.arange(1, len(cones) + 1), each)[good].astype(float)


CONES = np.array([[0.45, 0.1, 0.2], [0.2, -0.5, 0.35]])


def test_cones_bring_all_tips_of_a_seat_together(rig, session):
    q, seat = seated(session, CONES, 40)
    q = q + session.rng.normal(0.0, 5e-6, q.shape)
    result = run(rig, table(q, seat=seat), held_out_share=0.0)
    (instrument,) = result.instruments
    assert instrument.name == "seat"
    assert instrument.rms_distance_after_m < 2.5e-5
    predicted = predict(predictor(rig, result), table(q, seat=seat))
    tips = np.stack([predicted[c] for c in ("tip_x_m", "tip_y_m", "tip_z_m")], axis=1)
    for k in (1.0, 2.0):
        assert np.linalg.norm(tips[seat == k].std(axis=0)) < 3e-5


def test_a_cone_that_is_left_with_one_row_goes_too_and_both_rows_are_named(rig, session):
    q, seat = seated(session, np.concatenate([CONES, [[0.3, 0.3, 0.4]]]), 40)
    surplus = np.flatnonzero(seat == 3.0)[2:]
    q, seat = np.remainder(np.delete(q, surplus, axis=0) + np.pi, 2.0 * np.pi) - np.pi, np.delete(seat, surplus)
    q[-2, 3] = 9.0
    result = run(rig, table(q, seat=seat), held_out_share=0.0)
    found = [(b.kind, b.rows) for b in result.blunders]
    assert found == [(GrossErrorKind.BEYOND_LIMITS, (len(q) - 2,)), (GrossErrorKind.LEFT_ALONE, (len(q) - 1,))]
    assert not any(p.name.startswith("seat3") for p in result.parameters)
    assert result.n_samples == len(q) - 2


def test_a_bar_gives_the_scale_that_cones_do_not_have(rig, session):
    q, seat = seated(session, CONES, 30)
    a = session.rng.uniform([0.2, -0.3, 0.1], [0.5, 0.3, 0.5], (30, 3))
    way = Rotation.random(30, rng=session.rng).apply([BAR_M, 0.0, 0.0])
    way[:, 0] = -np.abs(way[:, 0])
    ends, good = session.reaching(np.stack([a, a + way], axis=1).reshape(-1, 3))
    both = np.repeat(good.reshape(-1, 2).all(axis=1), 2)
    ends = ends[both]
    n, m = len(q), len(ends)
    nothing, letters = np.full(n, np.nan), np.array([""] * n + ["a", "b"] * (m // 2))
    samples = table(
        np.concatenate([q, ends]),
        seat=np.concatenate([seat, np.full(m, np.nan)]),
        bar=np.concatenate([nothing, np.ones(m)]),
        bar_end=letters,
    )
    result = run(rig, samples, held_out_share=0.0)
    assert [i.name for i in result.instruments] == ["seat", "bar"]
    assert result.instruments[1].observations == m // 2 > 15
    assert all(i.rms_distance_after_m < i.rms_distance_before_m for i in result.instruments)


def test_no_observation_at_all_is_refused_by_name(rig, session):
    with pytest.raises(DataError, match="no row holds an observation"):
        run(rig, table(session.readings(30)))
