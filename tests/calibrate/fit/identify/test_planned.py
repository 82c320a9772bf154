"""A plan changes what is fitted and how, and nothing else; what it cannot have is refused by name."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import ArmModel
from calibrate.errors import DataError
from calibrate.fit.fit_plan import (
    AnglesName,
    FitPlan,
    LossName,
    RedundantName,
    SolverName,
    parse_plan,
)
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.session import rig_as_planned
from calibrate.model.predict import Predictor, predict
from tests.calibrate.fit.identify.conftest import Session, table

NOISE_M = 1e-5
AXES = ("x_m", "y_m", "z_m")


@pytest.fixture(scope="module")
def session(ur5e_truth):
    """Makes one of its own for each table, which then does not depend on those before it."""
    return lambda: Session(ur5e_truth(np.random.default_rng(5), zero_max=5e-3))


@pytest.fixture(scope="module")
def tracked(rig, session):
    session = session()
    rig = msgspec.structs.replace(rig, noise=msgspec.structs.replace(rig.noise, position_m=NOISE_M))
    q = session.readings(150)
    return rig, table(q, **session.positions(q, NOISE_M))


@pytest.fixture(scope="module")
def plain(tracked):
    """The answer by the plan that names nothing."""
    return run(tracked)


@pytest.fixture(scope="module")
def fresh(session):
    session = session()
    q = session.readings(230)[150:]  # behind those that are fitted
    return table(q, **session.positions(q, 0.0))


def run(tracked, share=0.0, **keys):
    plan = FitPlan(schema=1, **keys)
    return identify(*tracked, rng=np.random.default_rng(0), plan=plan, held_out_share=share)


def error_m(tracked, result, fresh, **keys):
    rig = rig_as_planned(tracked[0], FitPlan(schema=1, **keys))
    values = {p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)}
    predicted = predict(Predictor(rig, values, result.about, ("position",)), fresh)
    return np.sqrt(np.mean([predicted[f"r_{c}"] ** 2 for c in AXES]))


def lines(result):
    return {e.name: e for e in result.estimates if e.value is not None}


def test_what_is_held_freed_and_assumed_is_so_in_the_fit(tracked):
    priors = {"link*.length": 5e-4, "link2.length": 1e-4}
    result = run(tracked, hold=("link6.*", "link2.offset"), free=("link3.*",), priors=priors)
    now = {p.name: p for p in result.parameters}
    assert not any(now[f"link6.{k}"].free for k in ("offset", "length", "twist"))
    assert (now["link3.length"].prior, now["link2.length"].prior) == (5e-4, 1e-4)
    assert np.isinf(now["link3.twist"].prior)
    assert np.isfinite(now["link4.twist"].prior)
    reasons = {e.name: e.why for e in result.estimates}
    assert reasons["link6.length"] == reasons["link2.offset"] == "held at its nominal value"


def test_the_arm_may_be_fitted_in_another_model(tracked, fresh, plain):
    for model in (ArmModel.MDH, ArmModel.LOCAL_POE):
        other = run(tracked, model=model)
        assert {p.name for p in other.parameters} != {p.name for p in plain.parameters}
        assert error_m(tracked, other, fresh, model=model) < 0.6 * NOISE_M


def test_dog_leg_gives_the_same_answer_and_a_loss_one_within_the_uncertainty(tracked, plain):
    own = lines(plain)
    dogleg = lines(run(tracked, solver=SolverName.DOGLEG))
    huber = lines(run(tracked, loss=LossName.HUBER))
    for name, e in own.items():
        assert abs(dogleg[name].value - e.value) < 1e-3 * e.sigma
        assert abs(huber[name].value - e.value) < 1.5 * e.sigma
    assert max(abs(huber[n].value - e.value) / e.sigma for n, e in own.items()) > 0.01


@pytest.mark.parametrize("loss", [LossName.CAUCHY, pytest.param(LossName.STUDENT_T, marks=pytest.mark.endure)])
def test_a_loss_that_forgives_predicts_as_well(tracked, fresh, loss):
    assert error_m(tracked, run(tracked, loss=loss), fresh) < 0.8 * NOISE_M


def test_redundant_parameters_held_by_priors_have_no_number_either(tracked, fresh, plain):
    removed, pulled = plain, run(tracked, redundant=RedundantName.PRIORS)
    assert error_m(tracked, pulled, fresh) < 0.6 * NOISE_M
    for result in (removed, pulled):
        assert not {"joint1.zero", "device.yaw", "joint6.zero"} & set(lines(result))
    shared = set(lines(removed)) & set(lines(pulled))
    assert len(shared) > 8
    for name in shared:
        assert abs(lines(removed)[name].value - lines(pulled)[name].value) < lines(removed)[name].sigma


def test_share_and_splits_are_those_of_the_plan(tracked):
    result = identify(*tracked, rng=np.random.default_rng(0), plan=FitPlan(schema=1, share=0.4))
    assert [u.observations for u in result.held_out] == [60, 60]


def test_spots_as_lines_are_an_instrument_too(rig, sessions):
    lit = sessions(62, n=40, spread=0.0, places=(1,))
    names = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
    spots = dict(zip(names, lit.spots_m.T, strict=True))
    samples = table(lit.q_rad, placement=lit.placement.astype(float), first_psd=lit.first_psd.astype(float), **spots)
    result = run((rig, samples), instruments=("point",))
    assert [i.name for i in result.instruments] == ["point"]


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"hold": ("link2.lenght",)}, "matches 'link2.lenght'; did you mean 'link2.length'"),
        ({"priors": {"placement9.x": 1e-3}}, "no parameter of this session matches 'placement9.x'"),
        ({"instruments": ("position", "wire")}, "instrument 'wire': the samples hold no row"),
    ],
)
def test_what_rig_or_samples_do_not_have_is_refused_by_name(tracked, keys, says):
    with pytest.raises(DataError, match=says):
        run(tracked, **keys)


SEATING_RAD = 1e-4  # by which the link stands off what the controller reads
ENCODER_ZEROS = np.array([0.7, -2.9, 3.1, 1.1, -0.2, 2.0])
SENSES = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def with_encoders(rig, session):
    session = session()
    rig = msgspec.structs.replace(rig, noise=msgspec.structs.replace(rig.noise, position_m=NOISE_M))
    link = session.readings(150)
    q = link - SEATING_RAD * np.random.default_rng(4).standard_normal(link.shape)
    read = (SENSES * link + ENCODER_ZEROS) % (2.0 * np.pi)
    encoders = {f"enc{i + 1}_rad": read[:, i] for i in range(6)}
    return rig, table(q, **session.positions(link, NOISE_M), **encoders)


def test_second_encoders_may_drive_the_arm_whatever_their_zeros_and_senses(with_encoders):
    by_controller = lines(run(with_encoders))
    by_encoders = lines(run(with_encoders, angles=AnglesName.ENCODERS))
    zeros = [name for name in by_encoders if name.startswith("joint") and name.endswith(".zero")]
    assert zeros
    for name in zeros:  # about the controller's zeros, not about those of the encoders
        assert abs(by_encoders[name].value) < 0.05
        assert by_encoders[name].sigma < 0.5 * by_controller[name].sigma


def test_second_encoders_are_an_instrument_where_the_plan_lists_them(with_encoders):
    listed = ("position", "encoder-difference")
    found = lines(run(with_encoders, instruments=listed))
    for i in range(6):  # zeros are those of the encoder turned to the joint's sense
        away = found[f"encoder{i + 1}.zero"].value - SENSES[i] * ENCODER_ZEROS[i]
        assert abs((away + np.pi) % (2.0 * np.pi) - np.pi) < 5.0 * SEATING_RAD


def test_encoders_cannot_be_angles_and_an_observation_at_once():
    text = 'schema = 1\nangles = "encoders"\ninstruments = ["position", "encoder-difference"]\n'
    with pytest.raises(DataError, match="no encoder-difference to observe"):
        parse_plan(text, "fit.toml")
