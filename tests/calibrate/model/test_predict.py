"""A model alone predicts what every instrument would read, under the columns' own names, a row for a row."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig, rig_sha256, rig_text
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.model.model_file import RigIdentity
from calibrate.model.predict import Predictor, predict
from tests.calibrate.conftest import spot_samples

Q = np.array([[0.1, -1.2, 1.3, -0.8, 0.4, 0.2], [0.5, -1.0, 1.1, -0.3, 0.9, -0.6], [-0.7, -1.4, 0.9, 0.2, 0.3, 1.0]])
TURN = (0.3, -0.4, 2.2)


@pytest.fixture(scope="module")
def rig_path(request):
    return request.config.rootpath / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def rig(rig_path):
    return load_rig(rig_path)


def pose(origin, rotation):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(rotation).as_matrix(), origin
    return T


def table(q=Q, **columns):
    readings = {f"q{i + 1}_rad": q[:, i] for i in range(6)}
    return Samples({"t_s": np.arange(len(q), dtype=float), **readings, **columns}, 6)


@pytest.fixture
def predictor(rig):
    about = {"tool": (0.02, -0.01, 0.08), "device": (1.8, -0.6, 0.4, *TURN)}
    return Predictor(rig, {"tool.x": 1e-3, "device.z": 0.05}, about, ("position",))


@pytest.fixture
def tips(ur5e_exact):
    return np.array([(ur5e_exact().flange(q) @ [0.021, -0.01, 0.08, 1.0])[:3] for q in Q])


def test_positions_are_those_in_the_frame_of_the_device(predictor, tips):
    place = pose((1.8, -0.6, 0.4), TURN) @ pose((0, 0, 0.05), (0, 0, 0))
    seen = (tips - place[:3, 3]) @ place[:3, :3]
    out = predict(predictor, table())
    assert list(out) == ["t_s", "x_m", "y_m", "z_m"]
    np.testing.assert_allclose(np.stack([out[c] for c in ("x_m", "y_m", "z_m")], axis=1), seen, atol=1e-12)


def test_residuals_stand_where_the_row_has_an_observation(predictor):
    given = predict(predictor, table())
    x = given["x_m"] - 1e-3
    x[1] = np.nan
    zeros = np.where(np.isnan(x), np.nan, 0.0)
    out = predict(predictor, table(x_m=x, y_m=zeros, z_m=zeros))
    np.testing.assert_allclose(out["r_x_m"], [1e-3, np.nan, 1e-3], atol=1e-12)
    assert np.all(np.isfinite(out["x_m"]))


def test_an_orientation_near_half_a_turn_is_written_as_the_observed_one(predictor, ur5e_exact):
    flange = Rotation.from_matrix([ur5e_exact().flange(q)[:3, :3] for q in Q])
    seen = Rotation.from_rotvec(TURN).inv() * flange
    axis = np.array([0.6, 0.0, 0.8])
    mounted = seen[0].inv() * Rotation.from_rotvec((np.pi - 1e-4) * axis)  # what the first row then reads
    about = {**predictor.about, "tool": (0.02, -0.01, 0.08, *mounted.as_rotvec())}
    beyond = (seen * mounted).as_rotvec()
    beyond[0] = -(np.pi - 1e-4) * axis
    position = dict.fromkeys(("x_m", "y_m", "z_m"), np.zeros(3))
    columns = dict(zip(("rx_rad", "ry_rad", "rz_rad"), beyond.T, strict=True))
    out = predict(Predictor(predictor.rig, {}, about, ("full-pose",)), table(**position, **columns))
    residual = np.stack([out[f"r_{c}"] for c in columns], axis=1)
    np.testing.assert_allclose(residual[0], -2e-4 * axis, atol=1e-12)
    np.testing.assert_allclose(residual[1:], 0.0, atol=1e-12)


def test_a_wire_is_the_distance_from_the_origin_of_the_device(predictor, tips):
    place = pose((1.8, -0.6, 0.4), TURN) @ pose((0, 0, 0.05), (0, 0, 0))
    out = predict(predictor, table(wire_m=np.full(3, np.nan)))
    np.testing.assert_allclose(out["wire_m"], np.linalg.norm(tips - place[:3, 3], axis=1), atol=1e-12)


def test_a_model_that_knows_only_distances_predicts_those_between_rows(rig, tips):
    only = Predictor(rig, {"tool.x": 1e-3}, {"tool": (0.02, -0.01, 0.08)}, ("distance",))
    unknown_frame = pose((5.0, -2.0, 1.0), TURN)  # a frame that nobody knows
    moved = tips @ unknown_frame[:3, :3].T + unknown_frame[:3, 3]
    out = predict(only, table(**dict(zip(("x_m", "y_m", "z_m"), moved.T, strict=True))))
    assert list(out) == ["t_s", "distance_m", "r_distance_m"]
    spans = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    np.testing.assert_allclose(out["distance_m"], [np.nan, *spans], atol=1e-12)
    np.testing.assert_allclose(out["r_distance_m"], [np.nan, 0.0, 0.0], atol=1e-12)
    assert list(predict(only, table())) == ["t_s", "distance_m"]


def test_seat_and_bar_rows_get_the_tip_in_the_base_and_others_none(predictor, tips):
    out = predict(predictor, table(seat=np.array([1.0, np.nan, np.nan]), bar=np.array([np.nan, np.nan, 1.0])))
    found = np.stack([out[c] for c in ("tip_x_m", "tip_y_m", "tip_z_m")], axis=1)
    np.testing.assert_allclose(found[[0, 2]], tips[[0, 2]], atol=1e-12)
    assert np.all(np.isnan(found[1]))
    assert "x_m" not in out


def test_spots_come_from_the_model_file_alone(sessions, rig, rig_path):
    session = sessions(41, n=60, repeats=6)
    result = identify(rig, spot_samples(session), rng=np.random.default_rng(0), held_out_share=0.0)
    text = rig_text(rig_path)
    predictor = Predictor.of(record_of(result, RigIdentity(rig.name, rig_sha256(text), text), "dh"))
    placement = session.placement.astype(float)
    placement[3] = np.nan
    names = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
    spots = dict(zip(names, session.spots_m.T, strict=True))
    samples = table(session.q_rad, placement=placement, first_psd=session.first_psd.astype(float), **spots)
    out = predict(predictor, samples)
    residual = np.stack([out[f"r_{c}"] for c in names], axis=1)
    assert np.all(np.isnan(residual[3]))
    assert np.sqrt(np.nanmean(residual**2)) < 5e-6
    by_points = predict(replace(predictor, instruments=("point",)), samples)  # predicts none itself
    assert list(by_points) == list(out)


def test_a_model_without_its_rig_is_refused(sessions, rig):
    session = sessions(41, n=60, repeats=6)
    result = identify(rig, spot_samples(session), rng=np.random.default_rng(0), held_out_share=0.0)
    with pytest.raises(DataError, match="the rig's text is not in the file"):
        Predictor.of(record_of(result, RigIdentity(rig.name, "0" * 64), "dh"))


def test_a_device_that_nobody_knows_is_refused(rig):
    with pytest.raises(DataError, match=r"no \[device\]"):
        predict(Predictor(rig, {}, {}, ("position",)), table())
