"""For every effect of the catalogue: a column that it needs and a row lacks is named, and widens the sigma.

A model is put together by hand: the geometry of a concealed session in which every column is recorded, and one effect
of a plain size. The covariance holds nothing, so that all of a sigma comes from what is missing.
"""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples, read
from calibrate.apply.predicting import predict_with_physics
from calibrate.diagnose.gross_errors import Cleared
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.model.effect_records import EffectRecord, SessionRecord
from calibrate.model.effects.catalogue import holds_of, terms_of
from calibrate.model.effects.curve import SmoothCurve
from calibrate.model.effects.second_encoders import SECOND
from calibrate.model.effects.term import Shape
from calibrate.model.model_file import Covariance
from calibrate.model.with_effects.applied import needed_columns, recorded_conditions
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import FAMILIES, Wanted
from tests.calibrate.model.effects.conftest import SAMPLES, SEED, with_every_driver

PLAIN = 1e-4  # rad, m or a share: the largest that the effect adds at its port
NAME = "one-effect"
ASKED = 12  # rows


@cache
def known(family):
    """Geometry of a session as a model, its fit, its samples with every column."""
    with tempfile.TemporaryDirectory() as folder:
        places = 4 if family == "cones" else 3
        write_case(conceal(Wanted(family, SEED, samples=SAMPLES, places=places)), Path(folder))
        recording = read(Path(folder) / "recording")
    samples = with_every_driver(recording.samples)
    fit = fit_geometry(session_of(recording.rig, samples))
    recording = replace(recording, samples=samples)
    model = model_of_fit(fit, fit, Cleared(samples, np.arange(len(samples)), ()), recording, "geometry alone")
    return model, fit, samples


def listed(fit, *, every_place):
    """One term of each physics and set of drivers, numbers of joints aside; or of each kind of place and form, too."""
    out = {}
    for term in terms_of(fit.drivers):
        drivers = ",".join(d.rstrip("0123456789") for d in term.depends_on)
        place = (term.port.where.rstrip("0123456789"), term.shape, term.order) if every_place else ()
        inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
        if np.any(term.basis(fit.drivers, inner)):  # about a vertical axis nothing has weight
            out.setdefault((term.physics, drivers, term.open, *place), term)
    return list(out.values())


def carrying(model, fit, samples, term):
    """The model with this term as its one effect, columns that it needs, and whether it is true of its session only."""
    inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
    basis = term.basis(fit.drivers, inner)
    direction = np.random.default_rng(SEED).normal(size=basis.shape[-1])
    coefficients = direction * PLAIN / np.max(np.abs(basis @ direction))
    every = recorded_conditions(fit.drivers, fit.session.samples)
    needs = needed_columns(term.depends_on, every)
    effect = EffectRecord(
        name=NAME,
        where=term.port.where,
        physics="unknown" if term.open else term.physics,
        depends_on=",".join(term.depends_on),
        shape=term.shape.value,
        order=term.order,
        variant=SECOND
        if isinstance(term, SmoothCurve) and term.port.instrument == "encoder-difference"
        else term.variant,
        parameters={},
        coefficients={f"{NAME}.c{j}": float(c) for j, c in enumerate(coefficients)},
        inner={spec.name: float(v) for spec, v in zip(term.inner, inner, strict=True)},
        about={},
        holds=holds_of(term).value,
        range={},
        listed=term.physics if term.open else "",
        component=term.component if isinstance(term, SmoothCurve) else None,
        waves=term.waves if isinstance(term, SmoothCurve) else None,
    )
    conditions = {name: tuple(None if np.isnan(v) else float(v) for v in column) for name, column in every.items()}
    session = SessionRecord("", float(min(conditions["t_s"])), float(max(conditions["t_s"])), "0" * 64, conditions)
    names, nothing = tuple(effect.coefficients), (0.0,) * len(coefficients)
    covariance = Covariance(names, (nothing,) * len(names))
    whole = msgspec.structs.replace(model, effects=(effect,), needs=needs, session=session, covariance=covariance)
    return whole, needs


def check_each_missing_column(family, *, every_place):
    """Number of columns that were left out, one at a time."""
    model, fit, samples = known(family)
    every, missed = recorded_conditions(fit.drivers, samples), 0
    asked = Samples({c: v[:ASKED] for c, v in {**samples.columns, **every}.items()}, samples.n_joints)
    for term in listed(fit, every_place=every_place):
        whole, needs = carrying(model, fit, samples, term)
        same_session = whole.effects[0].holds == "session"
        if needs:
            assumed = predict_with_physics(whole, asked, same_session).notes
            assert all("centre of mass" in note for note in assumed)  # where the family carries loads without one
        for column in needs:
            if same_session and column.startswith("temp_"):
                continue  # the session itself has recorded the temperature of its rows
            less = Samples({c: v for c, v in asked.columns.items() if c != column}, samples.n_joints)
            found = predict_with_physics(whole, less, same_session)
            widest = max(float(np.nanmax(v)) for c, v in found.columns.items() if c.startswith("s_"))
            named = [note for note in found.notes if note.startswith(f"{column} is missing") and NAME in note]
            assert (widest > 0.0) == bool(named), (term.key, column)
            of_both = column.startswith("psd") and not term.depends_on[0].startswith(column[:4])
            side = term.shape is Shape.SIGN and term.depends_on[0].startswith("gravity_torque")  # no load may turn it
            assert named or of_both or side, (term.key, column)
            missed += 1
    return missed


@pytest.mark.endure  # daily: test_rows_apart.py, and a dropped driver in tests/calibrate/model/effects
def test_a_missing_column_is_named_and_widens_the_sigma_of_every_effect():
    assert check_each_missing_column("dual-psd", every_place=False) >= 20


@pytest.mark.endure
@pytest.mark.parametrize("family", FAMILIES)
def test_so_it_is_at_every_kind_of_place_and_under_every_instrument(family):
    assert check_each_missing_column(family, every_place=True) >= 40
