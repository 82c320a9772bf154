"""For every effect of the catalogue: a row is predicted alike alone, among others, and under a steady condition.

Without a condition, it is predicted with the same sigma or a wider one, and never refused.
"""

from functools import cache

import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.apply.predicting import predict_with_physics
from calibrate.model.effects.catalogue import EFFECTS, terms_of
from calibrate.model.with_effects.applied import recorded_conditions
from tests.calibrate.model.with_effects.test_conditions_of_catalogue import carrying, known, listed

MANY, FEW = 12, 1  # rows: the first once moved the mean so far that a prediction was refused
STEADY_DEGC = 0.8  # of the recorded range, far from its mean
LEAN = 1e-4  # the arm stands elsewhere under the mean load: its levers are as much longer or shorter


def steady(fit, samples):
    """Rows of the session, all at one temperature within its range; and the temperatures' columns."""
    columns = {**samples.columns, **recorded_conditions(fit.drivers, samples)}
    rows = np.arange(MANY) % len(samples)
    asked = {c: v[rows] for c, v in columns.items()}
    warm = [c for c in asked if c.startswith("temp_")]
    for c in warm:
        low, high = columns[c].min(), columns[c].max()
        asked[c] = np.full(MANY, low + STEADY_DEGC * (high - low))
    return Samples(asked, samples.n_joints), warm


@cache
def asked_of(family, every_place):
    """Terms of every physics; a whole arm is named as its longest link."""
    _, fit, _ = known(family)
    whole_arm = [t for t in terms_of(fit.drivers) if t.variant == "whole arm"]
    return (*listed(fit, every_place=every_place), *whole_arm)


def check_every_term_of(physics, family, *, every_place):
    model, fit, samples = known(family)
    asked, warm = steady(fit, samples)
    for term in asked_of(family, every_place):
        if term.physics != physics:
            continue
        whole, needs = carrying(model, fit, samples, term)
        same_session = whole.effects[0].holds == "session"
        together = predict_with_physics(whole, asked, same_session)
        for row in range(FEW):
            alone = Samples({c: v[row : row + 1] for c, v in asked.columns.items()}, asked.n_joints)
            found = predict_with_physics(whole, alone, same_session)
            for c, v in found.columns.items():
                np.testing.assert_allclose(v[0], together.columns[c][row], rtol=0.0, atol=1e-9, err_msg=f"{term.key}")
        moves = [c for c in needs if c.startswith(("last_move", "approach"))]
        if moves:  # of rows of the session itself, which knows how they were reached
            plain = Samples({c: v for c, v in asked.columns.items() if c not in moves}, asked.n_joints)
            found = predict_with_physics(whole, plain, True).columns
            stated = (together if same_session else predict_with_physics(whole, asked, True)).columns
            for c, v in found.items():
                np.testing.assert_allclose(v, stated[c], rtol=0.0, atol=1e-9, err_msg=f"{term.key}")
        for gone in (warm, *([name] for name in needs)):
            without = Samples({c: v for c, v in asked.columns.items() if c not in gone}, asked.n_joints)
            less = predict_with_physics(whole, without, same_session)
            for c in (c for c in less.columns if c.startswith("s_")):
                wider = (less.columns[c] >= together.columns[c] * (1.0 - LEAN) - 1e-9) | np.isnan(less.columns[c])
                assert np.all(wider), (term.key, gone, c)


NAMES = tuple(dict.fromkeys(effect.physics for effect in EFFECTS))


@pytest.mark.parametrize("physics", NAMES)
def test_a_row_is_predicted_alike_alone_among_others_and_without_a_condition(physics):
    check_every_term_of(physics, "tracker", every_place=False)


@pytest.mark.endure
def test_so_it_is_at_every_link_that_grows_before_a_tracker():
    check_every_term_of("link-thermal-growth", "tracker", every_place=True)


@pytest.mark.endure
@pytest.mark.parametrize("family", ["dual-psd", "wire", "cones"])
@pytest.mark.parametrize("physics", NAMES)
def test_so_it_is_at_every_kind_of_place_and_under_every_instrument(physics, family):
    check_every_term_of(physics, family, every_place=True)
