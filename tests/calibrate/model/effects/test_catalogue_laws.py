"""Laws that every entry of the catalogue keeps, on a session of every family with every driver recorded."""

import re
import string
from dataclasses import fields, replace
from functools import lru_cache

import numpy as np
import pytest

from calibrate.diagnose.state.visible import grid_of, sight_of
from calibrate.model.effects import catalogue
from calibrate.model.effects.catalogue import EFFECTS, missing_of
from calibrate.model.effects.ports import Place
from calibrate.model.effects.term import UNITS, Form, Shape
from simulators.conceal.wanted import FAMILIES
from tests.calibrate.model.effects.conftest import full_session

# The published lists of docs/formats.md.
PORTS = re.compile(
    r"joint\d+\.angle|link\d+\.(length|offset|twist|tilt)|base\.pose|tool\.point|laser\.(direction|origin)|fixture\.pose"
    r"|psd[12]\.reading|device\.(reading|pose)|seat\.position|time"
)
DRIVERS = re.compile(
    r"(q|gravity_torque|approach|qd|last_move|cmd_minus_q|spot|incidence)\d+|first_psd|previous_pose|overturning_moment"
    r"|t|temp_\w+|payload|psd\d_sum|reading"
)
TEXT = (
    "encoder-eccentricity encoder-harmonic gear-transmission-error gear-ratio-error joint-coupling "
    "joint-compliance payload-compliance backlash encoder-slip axis-wobble link-thermal-growth base-compliance "
    "base-moved latency reading-lag tool-sag link-bending psd-nonlinearity psd-gain psd-ambient-light "
    "psd-cover-glass laser-warm-up laser-thermal-drift fixture-moved device-scale device-drift device-periodic "
    "seat-moved tool-moved laser-moved not-settled unknown"
)
PHYSICS = set(TEXT.split())
SMALL = 1e-7
# Evaluations are what a round of the search costs; two thousand take half a second.
MOST_EVALUATIONS = 3200


terms_of = lru_cache(maxsize=8)(catalogue.terms_of)  # the same drivers are asked by every law


def width_of(term, drivers):
    match term.port.place:
        case Place.JOINTS:
            return drivers.n_joints
        case Place.FRAME | Place.SURROUNDINGS:
            return 6
        case Place.READING:
            return drivers.readouts[term.port.instrument].predicted.shape[1]


def middle_of(term):
    return np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])


def count_of(term, drivers):
    return term.basis(drivers, middle_of(term)).shape[2]


def test_bases_are_finite_and_as_wide_as_their_port(drivers):
    for term in terms_of(drivers):
        for inner in grid_of(term)[:: max(1, len(grid_of(term)) // 3)]:
            basis = term.basis(drivers, inner)
            assert basis.shape[:2] == (len(drivers.t_s), width_of(term, drivers)), term.key
            assert np.all(np.isfinite(basis)), term.key


def test_nothing_is_added_at_zero_and_small_amounts_are_linear(drivers):
    rng = np.random.default_rng(0)
    for term in terms_of(drivers):
        inner, basis = middle_of(term), term.basis(drivers, middle_of(term))
        small = SMALL * rng.normal(size=basis.shape[2])
        assert not np.any(term.amount(drivers, np.zeros(basis.shape[2]), inner)), term.key
        scale = SMALL * np.abs(basis).max(initial=0.0)
        linear = basis @ small
        off = np.abs(term.amount(drivers, small, inner) - linear)
        assert np.all(off <= np.maximum(1e-5 * scale, 1e-6 * np.abs(linear))), term.key


def test_smooth_inner_values_have_a_derivative(drivers):
    """Two steps of one length, one half as long: difference quotients agree."""
    for term in terms_of(drivers):
        for j, spec in enumerate(term.inner):
            if spec.discrete:
                continue
            step = 1e-5 * (spec.upper - spec.lower)
            slopes = []
            for h in (step, step / 2.0):
                high, low = middle_of(term), middle_of(term)
                high[j], low[j] = high[j] + h, low[j] - h
                slopes.append((term.basis(drivers, high) - term.basis(drivers, low)) / (2.0 * h))
            size = np.abs(slopes[0]).max()
            assert np.median(np.abs(slopes[0] - slopes[1])) <= 1e-4 * size, term.key


def test_grids_lie_within_their_bounds(drivers):
    for term in terms_of(drivers):
        for spec in term.inner:
            assert all(spec.lower <= x <= spec.upper for x in spec.grid), term.key
            assert list(spec.grid) == sorted(set(spec.grid)), term.key


def test_sizes_have_units_and_sentences_name_sizes_that_exist(drivers):
    for term in terms_of(drivers):
        m = count_of(term, drivers)
        inner = middle_of(term)
        sizes = term.sizes(np.full(m, 1e-5), 1e-12 * np.eye(m), inner, 1e-3 * np.abs(inner))
        for name in sizes:
            assert any(name.endswith(ending) for ending, _ in UNITS), (term.key, name)
        wanted = {name for _, name, _, _ in string.Formatter().parse(term.sentence) if name}
        assert wanted <= set(sizes), term.key
        lines = term.says(sizes)
        assert lines.count("±") == len(re.findall(r"\{\w+\}", term.sentence)), term.key
        assert "+-" not in lines
        assert "{" not in lines


def test_names_are_those_of_the_published_lists(drivers):
    for term in terms_of(drivers):
        assert PORTS.fullmatch(term.port.where), term.key
        assert term.physics in PHYSICS, term.key
        assert term.shape in Shape
        for name in ",".join(term.depends_on).split(","):
            assert name in drivers.extra or DRIVERS.fullmatch(name), term.key


def test_unknown_and_open_are_the_same_and_open_has_no_size_limit_below_noise(drivers):
    for term in terms_of(drivers):
        assert term.open == (term.physics == "unknown"), term.key
        m = count_of(term, drivers)
        assert term.plausible(np.zeros(m), middle_of(term), 0.0), term.key
        assert not term.plausible(np.full(m, 1e3), middle_of(term), 1e-6), term.key


def test_terms_of_time_are_slow(drivers):
    for term in terms_of(drivers):
        if term.depends_on == ("t",):
            assert term.slow, term.key


def test_no_two_terms_have_one_key(drivers):
    keys = [term.key for term in terms_of(drivers)]
    assert len(keys) == len(set(keys)), [key for key in keys if keys.count(key) > 1]


def test_the_catalogue_is_affordable(drivers):
    assert sum(len(grid_of(term)) for term in terms_of(drivers)) <= MOST_EVALUATIONS


def test_measured_readings_change_no_driver(fitted):
    """A term that saw what was measured could explain any noise: other readings at the same values, same bases."""
    rng = np.random.default_rng(1)
    problem, session = fitted.problem, fitted.session
    shaken = tuple(
        replace(
            m,
            problem=replace(m.problem, observed=m.problem.observed + 1e-3 * rng.normal(size=m.problem.observed.shape)),
        )
        for m in session.measured
    )
    other = replace(session, weighting=replace(session.weighting, measured=shaken))
    again = replace(fitted, session=other, problem=problem.of_session(other))
    for a, b in zip(terms_of(fitted.drivers), terms_of(again.drivers), strict=True):
        assert a.key == b.key
        assert np.array_equal(a.basis(fitted.drivers, middle_of(a)), b.basis(again.drivers, middle_of(b))), a.key


WITHOUT = {
    "qd_rad_s": (None, "latency"),
    "cmd_minus_q_rad": (None, "reading-lag"),
    "temperatures_degC": ({}, "link-thermal-growth"),
    "payload_kg": (None, "payload-compliance"),
    "approach_derived": (True, "backlash"),
}


# Of a wire and of cones nothing is dropped that a tracker does not have, too.
MORE = [pytest.param(family, marks=pytest.mark.endure) for family in FAMILIES if family not in ("dual-psd", "tracker")]


@pytest.mark.parametrize("fitted", ["dual-psd", "tracker", *MORE], indirect=True)
@pytest.mark.parametrize("driver", WITHOUT)
def test_a_dropped_driver_is_declared_missing_and_its_terms_are_gone(drivers, driver):
    nothing, physics = WITHOUT[driver]
    less = replace(drivers, **{driver: nothing})
    assert physics not in {m.physics for m in missing_of(drivers)}
    assert physics in {m.physics for m in missing_of(less)}
    for term in terms_of(less):
        assert np.all(np.isfinite(term.basis(less, middle_of(term)))), term.key


def test_ambient_light_asks_for_the_sums():
    drivers = full_session("dual-psd").drivers
    less = replace(drivers, psd_sum_v=None)
    assert "psd-ambient-light" in {m.physics for m in missing_of(less)}
    assert "psd-ambient-light" not in {term.physics for term in terms_of(less)}


def test_most_of_the_catalogue_can_be_seen(fitted):
    """Of a term that is seen at all, geometry leaves a share between nothing and everything."""
    sight, rows = sight_of(fitted.rows), fitted.rows
    shown = 0
    terms = terms_of(fitted.drivers)
    for term in terms:
        columns = fitted.columns(term, middle_of(term))
        size = np.linalg.norm(columns, axis=0)
        left = np.linalg.norm(sight.complement(columns.T).T, axis=0)
        assert np.all(left <= size * (1.0 + 1e-9)), term.key
        assert not np.any(columns[~rows.data]), term.key
        shown += bool(np.any(left**2 > 1e-5 * np.maximum(size**2, 1e-300)))
    assert shown > 0.8 * len(terms)


def test_every_effect_says_what_it_is():
    assert {effect.physics for effect in EFFECTS} == PHYSICS
    for effect in EFFECTS:
        assert effect.explains.endswith(".")
        assert effect.source
        assert set(effect.mistaken_for) <= PHYSICS
        assert fields(effect)


def test_a_step_says_when_and_a_drift_how_fast(drivers):
    for term in terms_of(drivers):
        if isinstance(term, Form) and not term.open:
            assert all(f"{{{spec.name}}}" in term.sentence for spec in term.inner if spec.name.startswith("time"))
