"""The same session with its arm written in every model: what is said of the readings does not depend on the writing."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import ArmModel
from calibrate.apply.export.export import FORMS, export_text
from calibrate.fit.identify.identify import identify
from calibrate.fit.solvers import Status
from calibrate.model.arms.convert import convert
from calibrate.model.predict import Predictor, predict
from tests.calibrate.conftest import spot_samples
from tests.calibrate.fit.identify.conftest import BAR_M, table

USABLE = (Status.CONVERGED, Status.RANK_DEFICIENT)
CONES_M = np.array([[0.45, 0.1, 0.2], [0.2, 0.45, 0.35], [-0.3, 0.35, 0.3]])


def written_as(rig, model):
    return msgspec.structs.replace(rig, tolerance=None, arm=convert(rig.arm, model).arm)


def positions(session):
    q = session.readings(60)
    return table(q, **session.positions(q, 1e-5))


def wire(session):
    q = session.readings(120)
    length = np.linalg.norm(session.tips(q) - [1.1, 0.9, 0.2], axis=1)
    return table(q, wire_m=length + session.rng.normal(0.0, 2e-5, len(q)))


def cones(session):
    seat = np.repeat(np.arange(3), 40)
    q, reached = session.reaching(CONES_M[seat] + session.rng.normal(0.0, 5e-6, (len(seat), 3)))
    return table(q[reached], seat=(seat[reached] + 1).astype(float))


def bars(session):
    ends = session.rng.uniform([0.2, -0.5, 0.1], [0.6, 0.5, 0.5], (40, 2, 3))
    along = ends[:, 1] - ends[:, 0]
    ends[:, 1] = ends[:, 0] + BAR_M * along / np.linalg.norm(along, axis=1, keepdims=True)
    ends += session.rng.normal(0.0, 5e-6, ends.shape)
    q, reached = session.reaching(ends.reshape(-1, 3))
    both = np.repeat(reached.reshape(-1, 2).all(axis=1), 2)
    end = np.array(["a", "b"] * len(ends), dtype=object)
    return table(q[both], bar=np.ones(both.sum()), bar_end=end[both])


# Daily for wires and bars in one writing: test_identify.py.
MORE = [pytest.param(samples, marks=pytest.mark.endure) for samples in (wire, bars)]


@pytest.mark.parametrize("samples", [positions, cones, *MORE])
def test_identified_predicted_and_exported_alike(rig, session, samples):
    seen, left, lines = samples(session), {}, {}
    for model in ArmModel:
        own = written_as(rig, model)
        result = identify(own, seen, rng=np.random.default_rng(1), held_out_share=0.0)
        assert result.status in USABLE, model
        values = {p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)}
        (instrument,) = result.instruments
        left[model] = instrument.rms_distance_after_m
        predicted = predict(Predictor(own, values, result.about, (instrument.name,)), seen)
        lines[model] = np.stack([predicted[c] for c in sorted(set(predicted) - {"t_s"})])
        for form in FORMS:
            assert export_text(own, values, form)
    np.testing.assert_allclose(list(left.values()), left[ArmModel.DH], rtol=1e-3)
    if instrument.name in (
        "position",
        "wire",
    ):  # a tip in the base turns with the base, which cones and bars leave open
        for model in ArmModel:
            np.testing.assert_allclose(lines[model], lines[ArmModel.DH], atol=2e-6, equal_nan=True)


def test_zeros_by_the_dual_psd_do_not_depend_on_the_writing_but_what_they_are_measured_from_does(rig, sessions):
    session = sessions(7, n=60, repeats=8)
    samples, found = spot_samples(session), {}
    for model in ArmModel:
        own = msgspec.structs.replace(rig, arm=convert(rig.arm, model).arm)
        found[model] = identify(own, samples, rng=np.random.default_rng(1), held_out_share=0.0)
    table, craig, six = (found[model].zeros[1:5] for model in (ArmModel.DH, ArmModel.MDH, ArmModel.LOCAL_POE))
    off = [(z.value_rad - true) / z.sigma_rad for z, true in zip(table, session.truth.zeros[1:5], strict=True)]
    assert max(map(abs, off)) < 3.5
    for a, b, c in zip(table, craig, six, strict=True):
        assert b.value_rad == pytest.approx(a.value_rad, abs=1e-8)
        assert b.sigma_rad == pytest.approx(a.sigma_rad, rel=1e-3)
        assert c.value_rad == pytest.approx(a.value_rad, abs=1e-6)
        assert c.sigma_rad > 100.0 * a.sigma_rad  # six errors a link: x of a link is drawn, not the common normal
    rms = [result.instruments[0].rms_distance_after_m for result in found.values()]
    np.testing.assert_allclose(rms, rms[0], rtol=5e-3)
