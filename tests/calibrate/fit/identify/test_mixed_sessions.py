"""Dual PSD, tracker and wire in one table of samples: one arm, proved for each instrument in its own unit."""

from functools import cache

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import Pose
from acquisition.recording.rig.schema import KnownDistance
from calibrate.fit.accuracy import Alarm
from calibrate.fit.fit_plan import FitPlan
from calibrate.fit.identify.identify import identify
from calibrate.fit.solvers import Status
from calibrate.model.predict import Predictor, predict
from tests.calibrate.fit.identify.conftest import SHIFT, TOOL, TURN, Session

SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
DUAL_PSD, POSITION = "dual-psd", "position"
LINKS = ("offset", "length", "twist", "tilt")
POSITION_M, WIRE_M, JOINT_RAD = 1e-5, 2e-5, 3e-6


def run(rig, samples, **options):
    return identify(rig, samples, rng=np.random.default_rng(0), **options)


def mixed_table(session, lit, n_tracked=60, n_wire=60):
    """Spots first, then positions, then wire lengths; each row holds one observation."""
    q = session.readings(n_tracked + n_wire)
    tip_q = q + session.rng.normal(0.0, JOINT_RAD, q.shape)
    tracked, pulled = tip_q[:n_tracked], tip_q[n_tracked:]
    seen = session.positions(tracked, POSITION_M)
    wire = np.linalg.norm(session.tips(pulled) - SHIFT, axis=1) + session.rng.normal(0.0, WIRE_M, n_wire)
    first, rest = len(lit.q_rad), n_tracked + n_wire
    columns = {name: behind(lit.spots_m[:, i], rest) for i, name in enumerate(SPOTS)}
    columns |= {"placement": behind(lit.placement, rest), "first_psd": behind(lit.first_psd, rest)}
    columns |= {name: behind(np.r_[np.full(first, np.nan), seen[name]], n_wire) for name in ("x_m", "y_m", "z_m")}
    columns["wire_m"] = np.r_[np.full(first + n_tracked, np.nan), wire]
    angles = np.concatenate([lit.q_rad, q])
    readings = {f"q{i + 1}_rad": angles[:, i] for i in range(6)}
    return Samples({"t_s": np.arange(len(angles), dtype=float), **readings, **columns}, 6)


def behind(values, missing):
    return np.concatenate([np.asarray(values, dtype=float), np.full(missing, np.nan)])


@pytest.fixture(scope="module")
def session(ur5e_truth):
    return Session(ur5e_truth(np.random.default_rng(5), zero_max=5e-3))


@pytest.fixture(scope="module")
def mixed(rig, session, sessions):
    noise = msgspec.structs.replace(rig.noise, position_m=POSITION_M, wire_m=WIRE_M, joint_rad=JOINT_RAD)
    lit = sessions(61, n=90, truth=session.truth)
    return msgspec.structs.replace(rig, noise=noise), mixed_table(session, lit)


@pytest.fixture(scope="module")
def identified(mixed):
    """The answer by some of the instruments, all where none is named, proved on unseen rows or not; made once each."""

    @cache
    def answer(*names, proved=False):
        plan = FitPlan(schema=1, instruments=names)
        return run(*mixed, plan=plan) if proved else run(*mixed, plan=plan, held_out_share=0.0)

    return answer


def true_corrections(rig, truth):
    """By parameter name, of arm and tool."""
    drawn = np.array([[j.d_m, j.a_m, j.alpha_rad, 0.0] for j in rig.arm.joints])
    off = truth.links - drawn
    links = {f"link{i}.{n}": v for i, row in enumerate(off, 1) for n, v in zip(LINKS, row, strict=True)}
    zeros = {f"joint{i}.zero": v for i, v in enumerate(truth.zeros, 1)}
    return links | zeros | {f"tool.{a}": v for a, v in zip("xyz", TOOL - rig.tool.point_m, strict=True)}


def test_what_is_said_of_the_arm_is_true(mixed, identified, session):
    rig, _ = mixed
    result = identified(proved=True)
    assert [i.name for i in result.instruments] == ["dual-psd", "position", "wire"]
    assert [i.observations for i in result.instruments] == [90, 60, 60]
    assert (result.status, result.blunders) == (Status.RANK_DEFICIENT, ())
    assert result.stated_noise.alarm is Alarm.NONE
    truth = true_corrections(rig, session.truth)
    lines = {e.name: e for e in result.estimates if e.value is not None and e.name in truth}
    off = {name: (e.value - truth[name]) / e.sigma for name, e in lines.items()}
    assert len(lines) > 18
    assert max(abs(v) for v in off.values()) < 4.0
    assert np.sqrt(np.mean(np.square(list(off.values())))) < 1.4
    assert not {"joint1.zero", "joint6.zero", "tool.x"} & set(lines)  # all that is at the flange turns with joint 6


def test_all_instruments_together_know_a_link_better_than_each_alone(identified):
    together, *alone = (identified(*names) for names in ((), (DUAL_PSD,), (POSITION,)))
    sigma = [next(e.sigma for e in one.estimates if e.name == "link2.length") for one in (together, *alone)]
    assert sigma[0] < min(sigma[1:])
    assert [[i.name for i in one.instruments] for one in alone] == [["dual-psd"], ["position"]]


def test_every_instrument_is_proved_in_its_own_unit_by_every_split(identified):
    result = identified(proved=True)
    assert result.evidence.proven.unproven == ()
    by = {(u.split, u.name): u for u in result.held_out}
    splits = ("random 20% of the rows", "each of 3 places in turn", "last 20% of the session")
    assert {split for split, _ in by} == set(splits)
    floor_m = {"dual-psd": 2e-6 * 2.0, "position": POSITION_M * np.sqrt(3.0), "wire": WIRE_M}
    for name, floor in floor_m.items():
        unseen = by[splits[0], name]
        assert 0.5 * floor < unseen.rms_distance_after_m < 3.0 * floor
        assert unseen.rms_distance_before_m > 10.0 * unseen.rms_distance_after_m
    assert by[splits[1], "dual-psd"].observations == 90
    assert (splits[1], "position") not in by
    assert [by[splits[2], "wire"].observations, (splits[2], "dual-psd") in by] == [42, False]


def test_the_model_predicts_what_each_instrument_reads(mixed, identified):
    rig, samples = mixed
    result = identified()
    values = {p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)}
    names = tuple(i.name for i in result.instruments)
    predicted = predict(Predictor(rig, values, result.about, names), samples)
    for column, noise in ((SPOTS[0], 4e-6), ("x_m", POSITION_M), ("wire_m", WIRE_M)):
        residual = predicted[f"r_{column}"]
        assert np.sqrt(np.nanmean(residual**2)) < 1.5 * noise


def test_a_known_distance_goes_with_the_place_that_is_left_out(mixed, session):
    rig, samples = mixed
    span = [session.truth.places[k][:3, 3] for k in (1, 2)]
    length = KnownDistance(1, 2, float(np.linalg.norm(span[1] - span[0])), 1e-5)
    result = run(msgspec.structs.replace(rig, known_distances=(length,)), samples)
    by_place = next(u for u in result.held_out if u.split.startswith("each"))
    assert by_place.rms_distance_after_m < 2e-5  # a place that stood where the drawing says would be off by millimetres


def test_tolerances_of_gains_second_face_and_device_reach_the_fit_as_priors(mixed):
    rig, samples = mixed
    stated = msgspec.structs.replace(
        rig.tolerance, gain=2e-3, psd2_m=5e-5, psd2_rad=1e-3, device_m=2e-3, device_rad=3e-3
    )
    place = Pose(tuple(SHIFT.tolist()), tuple(TURN.as_rotvec().tolist()))
    result = run(msgspec.structs.replace(rig, tolerance=stated, device=place), samples, held_out_share=0.0)
    prior = {p.name: p.prior for p in result.parameters if p.free}
    assert {prior[f"psd{k}.gain_{a}"] for k in (1, 2) for a in "xy"} == {2e-3}
    assert [prior["psd2.x"], prior["psd2.yaw"], prior["device.x"], prior["device.yaw"]] == [5e-5, 1e-3, 2e-3, 3e-3]
    lines = {e.name: e for e in result.estimates if e.value is not None}
    for name in ("psd1.gain_x", "psd2.gain_y"):
        assert abs(lines[name].value - 1.0) < 4.0 * lines[name].sigma
        assert lines[name].sigma < 1e-3
    assert "joint1.zero" in lines  # a device that is believed has a yaw to refer it to


def test_refits_to_drawn_rows_of_all_instruments_agree_with_the_covariance(mixed):
    rig, samples = mixed
    result = run(rig, samples, held_out_share=0.0, bootstrap_rounds=20)
    drawn = result.evidence.bootstrap
    assert drawn.failed == 0
    of_data = [i for i, p in enumerate(result.parameters) if p.free and p.name.endswith(".zero")]
    stated = np.sqrt(np.diag(result.covariance))
    ratio = [drawn.sigma()[i] / stated[i] for i in of_data if stated[i] > 0.0]
    assert 0.6 < np.median(ratio) < 1.6


def test_error_anywhere_needs_to_know_where_the_target_is_and_then_has_a_number(identified):
    whole, spots = (identified(*names).evidence.free_space for names in ((), (DUAL_PSD,)))
    assert 0.0 < whole.geometry.rms_m < whole.geometry.max_m < 2e-4
    assert whole.pose.rms_m > whole.geometry.rms_m
    assert spots.geometry.rms_m is None  # no spot says where around axis 6 the target point is
    assert any("joint 6 zero" in words for words in spots.geometry.undetermined)
