"""Every effect of the catalogue, with whatever instrument and however many targets, is carried by a model file: read
from the file it predicts the session that it was fitted to as the fit does.
"""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.linalg import block_diag

from acquisition.recording import Samples, read
from acquisition.recording.rig import parse_rig
from calibrate.apply.predicting import as_fitted, predict_with_physics
from calibrate.diagnose.gross_errors import Cleared
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.model.effects.base_moved import EFFECT as BASE_MOVED
from calibrate.model.effects.joint_compliance import EFFECT as COMPLIANCE
from calibrate.model.effects.term import Accepted, Shape
from calibrate.model.effects.time_laws import FOR_A_WHILE
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.with_effects.chain import Evaluations
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import FAMILIES, Wanted
from tests.calibrate.apply.export.tracked import tracked
from tests.calibrate.model.effects.conftest import SEED, with_every_driver
from tests.calibrate.model.with_effects.test_conditions_of_catalogue import listed

SAMPLES = 45
PLAIN = 1e-5  # rad, m or a share: the largest that an effect adds at its port
SAME = 1e-8  # m or rad: a driver follows the effects that move it
POINTS_M = {1: (0.02, 0.0, 0.06), 2: (-0.05, 0.03, 0.05), 7: (0.01, -0.06, 0.08)}
COUPLED = "fanuc-lrmate-200id"  # its joint 3 follows joint 2
SAME_SHARE = 1e-6  # of the rms that the fit leaves
SESSIONS = (*FAMILIES, "three targets", "second target", COUPLED)


@cache
def fitted(session):
    """A recording with every column, and the fit of its geometry."""
    family = session if session in FAMILIES else "tracker"
    with tempfile.TemporaryDirectory() as folder:
        if session == COUPLED:
            tracked(Path(folder) / "recording", COUPLED, rows=SAMPLES, seed=SEED)
        else:
            write_case(conceal(Wanted(family, SEED, samples=SAMPLES, places=4)), Path(folder))
        recording = read(Path(folder) / "recording")
    if session.endswith(("targets", "target")):
        recording = before_targets(recording, (1, 2, 7) if session == "three targets" else (2,))
    recording = replace(recording, samples=with_every_driver(recording.samples))
    return recording, fit_geometry(session_of(recording.rig, recording.samples))


def before_targets(recording, numbers):
    """The same poses, read in the base in turns of points of the flange."""
    frames = fit_geometry(session_of(recording.rig, recording.samples)).around.frames[:, -1]
    named = np.resize(numbers, len(frames))
    points = np.array([POINTS_M[k] for k in named.tolist()])
    seen = np.einsum("nij,nj->ni", frames[:, :3, :3], points) + frames[:, :3, 3]
    seen = seen + np.random.default_rng(SEED).normal(0.0, 1e-5, seen.shape)
    text = recording.rig_text + "".join(f"\n[[target]]\nid = {k}\npoint_m = {list(at)}\n" for k, at in POINTS_M.items())
    columns = {**recording.samples.columns, "target": named.astype(float)}
    columns |= dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))
    samples = Samples(columns, recording.samples.n_joints)
    return replace(recording, rig=parse_rig(text, "rig.toml"), rig_text=text, samples=samples)


def with_term(fit, term):
    """The fit with a term of a plain size put in, nothing refitted."""
    inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
    basis = term.basis(fit.drivers, inner)
    direction = np.random.default_rng(SEED).normal(size=basis.shape[-1])
    coefficients = direction * PLAIN / np.max(np.abs(basis @ direction))
    smooth = np.array([value for spec, value in zip(term.inner, inner, strict=True) if not spec.discrete])
    own, sizes = np.concatenate([coefficients, smooth]), (np.full(len(coefficients), PLAIN),)
    chain = fit.session.chain((Accepted(term, coefficients, inner),), fit.drivers)
    problem = replace(fit.problem, chain=chain, sizes=sizes, known=Evaluations())
    wider = block_diag(fit.covariance, np.zeros((len(own), len(own))))
    return replace(fit, problem=problem, values=np.concatenate([fit.geometry, own]), covariance=wider)


def left_by(fit):
    return [
        (m.name, m.sample_rows[rows, 0], m.problem.observed[rows] - e[rows])
        for m, rows, e in zip(fit.session.measured, fit.problem.rows, fit.around.expected, strict=True)
        if m.sample_rows.shape[1] == 1
    ]


def carry(session, every_place):
    """Number of effects that were carried."""
    recording, fit = fitted(session)
    samples = recording.samples
    cleared = Cleared(samples, np.arange(len(samples)), ())
    terms = listed(fit, every_place=every_place)
    for term in terms:
        with_one = with_term(fit, term)
        model = structs.replace(model_of_fit(with_one, fit, cleared, recording, "one effect"), covariance=None)
        read = predict_with_physics(model, samples, same_session=True).columns
        for name, rows, misfit in left_by(with_one):
            predicted = np.stack([read[f"r_{c}"][rows] for c in kind_of(name).reads], axis=1)
            assert np.sqrt(np.mean((predicted + misfit) ** 2)) < SAME, (name, term.key)
    return len(terms)


@pytest.mark.parametrize("session", SESSIONS)
def test_every_physics_is_carried(session):
    assert carry(session, every_place=False) > 20


@pytest.mark.endure
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("session", SESSIONS)
def test_every_physics_is_carried_at_every_kind_of_place(session):
    assert carry(session, every_place=True) > 60


def test_a_joint_that_yields_under_unknown_masses_is_carried_where_readings_are_coupled():
    recording, fit = fitted(COUPLED)
    term = next(t for t in COMPLIANCE.terms(fit.drivers) if t.depends_on == ("gravity_torque3",))
    with_one = with_term(fit, term)
    with_one = replace(with_one, problem=replace(with_one.problem, chain=settled(with_one)), before=None)
    cleared = Cleared(recording.samples, np.arange(SAMPLES), ())
    model = structs.replace(model_of_fit(with_one, fit, cleared, recording, "one effect"), covariance=None)
    read = predict_with_physics(model, recording.samples, same_session=True).columns
    ((name, rows, misfit),) = left_by(with_one)
    predicted = np.stack([read[f"r_{c}"][rows] for c in kind_of(name).reads], axis=1)
    assert np.sqrt(np.mean(predicted**2)) == pytest.approx(np.sqrt(np.mean(misfit**2)), rel=SAME_SHARE)


def settled(fit):
    """The chain of a fit at drivers that follow what its effects move."""
    chain = fit.problem.chain
    for _ in range(3):
        at = replace(fit, problem=replace(fit.problem, chain=chain, known=Evaluations()))
        chain = replace(chain, drivers=at.predicted)
    return chain


@pytest.mark.parametrize(("variant", "left"), [("", ["base-moved"]), (FOR_A_WHILE, [])])
def test_a_base_that_stands_as_before_leaves_nothing_behind(variant, left):
    recording, fit = fitted("cones")
    term = next(t for t in BASE_MOVED.terms(fit.drivers) if t.shape is Shape.STEP and t.variant == variant)
    cleared = Cleared(recording.samples, np.arange(SAMPLES), ())
    model = model_of_fit(with_term(fit, term), fit, cleared, recording, "a base that moved")
    assert [effect.after for effect in model.effects if effect.holds == "always"] == left


def test_a_model_that_predicts_its_session_worse_than_the_fit_states_both_numbers():
    recording, fit = fitted("tracker")
    model = model_of_fit(fit, fit, Cleared(recording.samples, np.arange(SAMPLES), ()), recording, "geometry alone")
    ((name, rows, misfit),) = left_by(fit)
    assert as_fitted(model, recording.samples, [(name, rows, misfit)]) is model
    moved_model = structs.replace(model, chain={**model.chain, "device.x": model.chain["device.x"] + 2e-5})
    warned = as_fitted(moved_model, recording.samples, [(name, rows, misfit)])
    assert structs.replace(warned, alarms=model.alarms) == moved_model
    (alarm,) = warned.alarms[len(model.alarms) :]
    assert alarm.startswith("Read from its file, the model misses positions of its own session by ")
    assert "and the fit left " in alarm
