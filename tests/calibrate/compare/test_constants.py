"""The fewest constants that explain a difference, in the quadratic around a fit of all of them."""

import numpy as np
import pytest

from calibrate.compare.constants import (
    LINK,
    ZERO,
    Part,
    Quadratic,
    alternatives,
    fewest,
    outermost,
    parts_of,
)
from calibrate.model.parameters import Parameter

ROWS = 200


def part(physics, number):
    where = f"joint{number}.angle" if physics == ZERO else f"link{number}.length"
    return Part(where, physics, (f"{where}.{number}",))


PARTS = (part(ZERO, 1), part(ZERO, 2), part(LINK, 1), part(LINK, 2))


def quadratic(G, true, seed=1):
    """Of rows (row, part) with unit noise."""
    y = G @ true + np.random.default_rng(seed).normal(size=len(G))
    covariance = np.linalg.inv(G.T @ G)
    at = tuple((p, np.array([k])) for k, p in enumerate(PARTS))
    price = np.log(len(G)) + 2.0 * np.log(len(at))
    return Quadratic(at, covariance @ (G.T @ y), covariance, len(G), price)


@pytest.fixture
def rows():
    return np.random.default_rng(2).normal(size=(ROWS, 4))


def test_a_sum_of_two_causes_is_not_taken_for_a_third(rows):
    rows[:, 3] = rows[:, 0] + rows[:, 2] + 0.2 * rows[:, 3]  # nearly what the two together do
    assert fewest(quadratic(rows, np.array([5.0, 0.0, 5.0, 0.0]))) == (PARTS[0], PARTS[2])


def test_a_frame_is_not_taken_for_many_links_that_stand_in_for_it():
    rng = np.random.default_rng(4)
    links = [part(LINK, number) for number in range(1, 9)]
    frame = Part("fixture.pose 1", "fixture-moved", tuple(f"placement1.{k}" for k in range(6)))
    G = rng.normal(size=(ROWS, 14))
    G[:, 8] = G[:, :8].sum(axis=1) + 0.05 * G[:, 8]
    y = 5.0 * G[:, 8] + rng.normal(size=ROWS)
    covariance = np.linalg.inv(G.T @ G)
    listed = (*((one, np.array([k])) for k, one in enumerate(links)), (frame, np.arange(8, 14)))
    whole = Quadratic(listed, covariance @ (G.T @ y), covariance, ROWS, np.log(ROWS) + 2.0 * np.log(len(listed)))
    assert fewest(whole) == (frame,)


def test_noise_is_no_constant(rows):
    assert fewest(quadratic(rows, np.zeros(4))) == ()


def test_of_two_that_hardly_differ_the_zero_is_named_and_the_link_an_alternative(rows):
    rows[:, 3] = rows[:, 1] + 1e-3 * rows[:, 3]
    whole = quadratic(rows, np.array([0.0, 0.0, 0.0, 5.0]))
    chosen = outermost(whole, (PARTS[3],))
    assert chosen == (PARTS[1],)
    assert [name.where for name in alternatives(whole, chosen)[PARTS[1]]] == ["link2.length"]


def test_parts_are_what_a_session_leaves_free_but_for_what_is_set_up_anew():
    names = ("joint1.zero", "link1.length", "tool.x", "tool.y", "tool.z", "placement2.x", "device.x", "encoder1.zero")
    names += ("psd2.x", "psd2.yaw", "psd2.gain_x")
    found = parts_of([Parameter(name, "m", 1.0, free=name != "link1.length") for name in names])
    assert [(one.where, len(one.names)) for one in found] == [
        ("joint1.angle", 1),
        ("tool.point", 3),
        ("fixture.pose 2", 1),
        ("psd2.reading", 2),
    ]
