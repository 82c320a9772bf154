"""A camera in the room: six sigmas, stated or not, that the residuals find again, and what they are good for."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.rounds import settled_fit
from calibrate.fit.identify.session import about_of, instruments_for_fit
from calibrate.fit.instruments import instruments_of
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.predict import Predictor, predict
from calibrate.model.sensors.catalogue import witnesses_of
from tests.calibrate.model.sensors.camera_sessions import (
    BODY,
    CAMERA,
    PLACE,
    SIGMA,
    TURN,
    CameraSession,
    table,
)

AS_TRACKER = ("x_m", "y_m", "z_m"), ("rx_rad", "ry_rad", "rz_rad")
SESSIONS, POSES, FRESH = 8, 60, 200


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture
def session(ur5e_truth):
    return CameraSession(ur5e_truth(np.random.default_rng(5), zero_max=5e-3), 11)


def fitted(rig, samples):
    found = instruments_for_fit(rig, samples)
    return settled_fit(found.weighting, found.start)


def found_sigmas(fit):
    assumed = [np.max(sigma) for sigma in fit.weighting.measured[0].own_sigma.values()]
    return np.exp(0.5 * fit.factors.log_variance[1:]) * assumed


def away(fit, q, place, turn):
    """(row, 6) expected less true readings at fresh poses, and their derivative by all parameters."""
    chain = fit.weighting.measured[0].problem.chain
    chain = replace(chain, sensor=replace(chain.sensor, R_device_target=turn.as_matrix()))
    own = fit.problem.of_block(0, fit.fit.theta)
    missed = chain.expect(own, q) - np.concatenate([place, np.zeros((len(q), 3))], axis=1)
    return missed, fit.problem.spread(0, chain.jacobian(own, q))


@pytest.fixture(scope="module")
def concealed(rig, ur5e_truth):
    """Of every concealed session: found sigmas, (row, 6) errors and sigmas at fresh poses, errors by equal weights."""
    out = []
    for seed in range(SESSIONS):
        session = CameraSession(ur5e_truth(np.random.default_rng(40 + seed), zero_max=5e-3), 70 + seed)
        q, fresh = session.poses(POSES), session.poses(FRESH)
        columns = session.columns(q)
        fit, truth = fitted(rig, table(q, **columns)), session.seen(fresh)
        missed, by = away(fit, fresh, *truth)
        sigma = np.sqrt(np.einsum("nki,ij,nkj->nk", by, fit.fit.covariance, by))
        same = dict(zip((*AS_TRACKER[0], *AS_TRACKER[1]), columns.values(), strict=True))
        nowhere = msgspec.structs.replace(rig, tool=msgspec.structs.replace(rig.tool, point_m=None))
        equal, _ = away(fitted(nowhere, table(q, **same)), fresh, *truth)
        out.append((found_sigmas(fit), missed, sigma, equal))
    return out


def test_the_noise_of_every_axis_is_found(concealed):
    found = np.array([sigmas for sigmas, *_ in concealed]) / SIGMA
    assert_allclose(np.sqrt(np.mean(found**2, axis=0)), 1.0, atol=0.12)  # 8 sessions of 60 rows: 3.5 % each
    assert np.all((found > 0.6) & (found < 1.5))


def test_95_per_cent_intervals_hold_the_true_readings_at_fresh_poses(concealed):
    inside = np.array([np.mean(np.abs(missed) < 1.96 * sigma) for _, missed, sigma, _ in concealed])
    assert 0.91 <= inside.mean() <= 0.99  # errors within a session go together: some 37 unknowns each


def test_weights_by_axis_beat_equal_weights(concealed):
    by_axis, equal = (np.sqrt(np.mean([one[k] ** 2 for one in concealed], axis=(0, 1))) for k in (1, 3))
    assert np.all(by_axis < equal)
    assert np.all(by_axis[:2] < 0.5 * equal[:2])  # across the optical axis, where a camera is good


def test_exact_readings_are_explained_to_rounding_and_camera_and_body_found(rig, ur5e_exact):
    session = CameraSession(ur5e_exact(), 3)
    q = session.poses(30)
    weighting = instruments_of(table(q, **session.columns(q, sigma=np.zeros(6))), rig).weighting
    about = about_of(weighting)
    assert_allclose(about["camera"], [*CAMERA[0], *CAMERA[1].as_rotvec()], atol=1e-8)
    assert_allclose(about["marker"], [*BODY[0], *BODY[1].as_rotvec()], atol=1e-8)
    assert "tool" not in about
    assert "device" not in about


def test_the_rig_states_a_sigma_for_every_axis(rig, session):
    stated = msgspec.structs.replace(rig.noise, camera_m=(1e-4, 2e-4, 3e-3), camera_rad=(1e-3, 2e-3, 3e-4))
    q = session.poses(20)
    (measured,) = instruments_of(
        table(q, **session.columns(q)), msgspec.structs.replace(rig, noise=stated)
    ).weighting.measured
    total = sum(sigma**2 for sigma in measured.own_sigma.values())
    assert_allclose(np.sqrt(total), np.tile([1e-4, 2e-4, 3e-3, 1e-3, 2e-3, 3e-4], (20, 1)))


def test_a_wrong_statement_is_corrected(rig, session):
    stated = msgspec.structs.replace(rig.noise, camera_m=(1e-3, 1e-3, 1e-4), camera_rad=(1e-3, 1e-3, 5e-3))
    q = session.poses(80)
    fit = fitted(msgspec.structs.replace(rig, noise=stated), table(q, **session.columns(q)))
    assert np.all(np.abs(np.log(found_sigmas(fit) / SIGMA)) < 0.35)


def test_a_gross_error_is_named_and_left_out(rig, session):
    q = session.poses(70)
    columns = session.columns(q)
    columns[PLACE[0]][17] += 0.02
    result = identify(rig, table(q, **columns), rng=np.random.default_rng(1))
    assert [gross_error.rows for gross_error in result.blunders] == [(17,)]


@pytest.mark.parametrize(
    ("names", "factor", "kind"),
    [(PLACE, 1e3, GrossErrorKind.MILLIMETRES), (TURN, 180.0 / np.pi, GrossErrorKind.DEGREES)],
)
def test_another_unit_explains_the_readings_better(rig, session, names, factor, kind):
    q = session.poses(60)
    columns = session.columns(q)
    for name in names:
        columns[name] *= factor
    (witness,) = [
        w for w in witnesses_of(rig, table(q, **columns), q) if "camera" in str(next(iter(w.otherwise())).column)
    ]
    place, turn = session.flange(q)
    T = np.tile(np.eye(4), (len(q), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = turn.as_matrix(), place
    as_written = witness.strain(T).compared_m
    best = min(witness.otherwise(), key=lambda other: other.witness.strain(T).compared_m)
    assert best.kind is kind
    assert best.witness.strain(T).compared_m < 0.1 * as_written


def test_a_position_without_its_orientation_is_refused(rig, session):
    q = session.poses(20)
    columns = session.columns(q)
    columns[TURN[0]][4] = np.nan
    with pytest.raises(DataError, match="samples row 5: camera_x_m without camera_rx_rad"):
        instruments_of(table(q, **columns), rig)


def test_a_model_predicts_what_the_camera_reads(rig, ur5e_exact):
    session = CameraSession(ur5e_exact(), 3)
    q, fresh = session.poses(30), session.poses(10)
    about = about_of(instruments_of(table(q, **session.columns(q, sigma=np.zeros(6))), rig).weighting)
    read = predict(Predictor(rig, {}, about, ("camera-pose",)), table(fresh, **session.columns(fresh, np.zeros(6))))
    place, _ = session.seen(fresh)
    assert_allclose(np.stack([read[name] for name in PLACE], axis=1), place, atol=1e-8)
    assert_allclose([read[f"r_{name}"] for name in (*PLACE, *TURN)], 0.0, atol=1e-7)


def test_a_model_without_a_camera_cannot_predict_one(rig, session):
    q = session.poses(5)
    with pytest.raises(DataError, match="no camera in it"):
        predict(Predictor(rig, {}, {}, ()), table(q, **session.columns(q)))
