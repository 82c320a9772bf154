"""Several targets on one flange in one session: a point each, found with the arm; one target is the ordinary way."""

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording.errors import SamplesError
from acquisition.recording.rig.schema import FlangeTarget
from acquisition.recording.sample_rules import checked_samples
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.wrong_file import wrong_file
from calibrate.fit.instruments import instruments_of
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from calibrate.model.predict import Predictor, predict
from tests.calibrate.fit.identify.conftest import SHIFT, TOOL, TURN, changed, table

NOISE_M = 2e-5
TRUE_M = {1: TOOL, 2: np.array([-0.071, 0.043, 0.061]), 7: np.array([0.012, -0.084, 0.072])}
DRAWN = tuple(FlangeTarget(k, tuple(np.round(point, 2).tolist())) for k, point in TRUE_M.items())
N = 90
TURNED = Rotation.from_rotvec([0.0, 0.0, -0.8]).as_matrix()  # of the bracket that carries them, about the last axis


@pytest.fixture
def several(rig):
    noise = msgspec.structs.replace(rig.noise, position_m=NOISE_M)
    tool = msgspec.structs.replace(rig.tool, point_m=None)
    return msgspec.structs.replace(rig, noise=noise, tool=tool, target_list=DRAWN)


def read_at(session, q, points_m, rng):
    """Positions of a point (row, 3) of the flange, by plain products of 4 x 4 matrices."""
    flange = np.array([session.truth.flange(one + session.truth.zeros) for one in q])
    tips = np.einsum("nij,nj->ni", flange[:, :3, :3], points_m) + flange[:, :3, 3]
    seen = TURN.inv().apply(tips - SHIFT) + rng.normal(0.0, NOISE_M, (len(q), 3))
    return dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))


@pytest.fixture
def drawn(session):
    """In turn: every row another of the three."""
    q, named = session.readings(N), np.resize(list(TRUE_M), N)
    points = np.array([TRUE_M[k] for k in named.tolist()])
    return table(q, **read_at(session, q, points, np.random.default_rng(12)), target=named.astype(float))


def test_each_target_is_a_point_of_its_own_and_fresh_rows_are_given_theirs(several, drawn, session):
    result = identify(several, drawn, rng=np.random.default_rng(0), held_out_share=0.0)
    values = {p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)}
    at = {k: result.about[f"target{k}"] + np.array([values[f"target{k}.{a}"] for a in "xyz"]) for k in TRUE_M}
    for k in (2, 7):  # lengths between targets: no frame or link can stand in for them
        apart = np.linalg.norm(at[k] - at[1])
        assert abs(apart - np.linalg.norm(TRUE_M[k] - TRUE_M[1])) < 5 * NOISE_M
    q, named = session.readings(30), np.resize([7.0, 1.0, 2.0], 30)
    points = np.array([TRUE_M[int(k)] for k in named])
    fresh = table(q, **read_at(session, q, points, np.random.default_rng(2)), target=named)
    lines = predict(Predictor(several, values, result.about, ("position",)), fresh)
    left = np.stack([lines[f"r_{a}_m"] for a in "xyz"])
    assert np.sqrt(np.mean(left**2)) < 3.0 * NOISE_M


def test_one_target_is_the_ordinary_way(several, rig, drawn, session):
    q = session.readings(60)
    seen = read_at(session, q, np.tile(TRUE_M[2], (60, 1)), np.random.default_rng(3))
    named = instruments_of(table(q, **seen, target=np.full(60, 2.0)), several)
    tool = msgspec.structs.replace(several.tool, point_m=DRAWN[1].point_m)
    plain = instruments_of(table(q, **seen), msgspec.structs.replace(several, tool=tool, target_list=()))
    free, all_free = ([p.free for p in i.weighting.parameters] for i in (named, plain))
    theirs, ours = plain.weighting.problem(plain.start), named.weighting.problem(named.start)
    assert_allclose(ours.residual(named.start), theirs.residual(plain.start), atol=1e-12)
    assert_allclose(ours.jacobian(named.start)[:, free], theirs.jacobian(plain.start)[:, all_free], atol=1e-8)


def test_several_targets_without_a_point_each_are_refused(several, drawn):
    with pytest.raises(DataError, match=r"targets 1, 2, 7, but rig .* has no \[\[target\]\]"):
        instruments_of(drawn, msgspec.structs.replace(several, target_list=()))


def test_a_wire_that_names_a_target_is_refused(several, drawn):
    tool = msgspec.structs.replace(several.tool, point_m=DRAWN[0].point_m)
    pulled = changed(drawn, wire_m=np.full(N, 1.0))
    with pytest.raises(DataError, match=r"samples row 1: target 1, but .* \[tool\] point_m only"):
        instruments_of(pulled, msgspec.structs.replace(several, tool=tool))


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        (3.0, r"3 is not a \[\[target\]\] of the rig"),
        (1.5, "not a whole number"),
        (None, "name theirs; name it here, too"),
    ],
)
def test_a_row_that_names_no_target_of_the_rig_is_refused(several, drawn, cell, says):
    cells = {name: drawn.columns[name].tolist() for name in drawn.names}
    cells["target"][4] = cell
    with pytest.raises(SamplesError, match=rf"row 4, column 'target': .*{says}"):
        checked_samples(cells, several, lambda row: f"row {row}")


def with_a_still_wrist(session):
    """Readings, and which target each row is of: target 1 in most, always with the last joint in one place."""
    q, named = session.readings(N), np.resize([1, 1, 1, 2, 7], N)
    q[named == 1, -1] = 0.4
    return q, named


def test_a_wrong_sign_shows_in_targets_that_were_read_less(several, session):
    q, named = with_a_still_wrist(session)
    points = np.array([TRUE_M[k] for k in named.tolist()])
    seen = read_at(session, q, points, np.random.default_rng(4))
    assert wrong_file(several, table(q, **seen, target=named.astype(float))) == ()
    q[:, -1] *= -1.0
    (found,) = wrong_file(several, table(q, **seen, target=named.astype(float)))
    assert found.column == "column q6_rad"


def test_targets_that_sit_not_where_drawn_are_no_wrong_sign_where_the_readings_fit(several, session):
    q, named = with_a_still_wrist(session)
    q[:, -1] = 0.4
    turned = {k: TURNED @ DRAWN[i].point_m for i, k in enumerate(TRUE_M)}
    arm = arm_of(several)
    flange = arm.flange(start_values(arm.parameters), q)
    tips = np.einsum("nij,nj->ni", flange[:, :3, :3], [turned[k] for k in named.tolist()]) + flange[:, :3, 3]
    seen = dict(zip(("x_m", "y_m", "z_m"), TURN.inv().apply(tips - SHIFT).T, strict=True))
    assert wrong_file(several, table(q, **seen, target=named.astype(float))) == ()
