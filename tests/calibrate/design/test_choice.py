"""Choosing poses: savings are what they say, exchanges find the best, and designs beat chance."""

from itertools import combinations

import numpy as np
import pytest

from calibrate.design.exchange import (
    CRITERIA,
    Determinant,
    WorkspaceError,
    choose,
    exchange,
    one_by_one,
)

EXACT = ("free-space", "d")


def known(criterion, poses):
    A = criterion.start()
    for pose in poses:
        A = criterion.with_(A, pose)
    return A


@pytest.mark.parametrize("name", CRITERIA)
def test_a_saving_is_what_the_loss_becomes_less_by(information, name):
    criterion = CRITERIA[name](information)
    A = known(criterion, range(0, 72, 2))
    savings = criterion.savings(A)
    looked_at = np.flatnonzero(np.isfinite(savings))
    assert len(looked_at) == 72 if name in EXACT else len(looked_at) >= 12
    for pose in looked_at[::7]:
        less = criterion.loss(A) - criterion.loss(criterion.with_(A, int(pose)))
        assert savings[pose] == pytest.approx(less, rel=1e-4, abs=1e-9 * abs(criterion.loss(A)))


@pytest.mark.parametrize("build", [WorkspaceError, Determinant])
def test_exchanges_find_the_best_of_all_choices(build):
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(9, 2, 4)) * rng.uniform(0.2, 3.0, (9, 1, 1))
    more = (np.diag([1.0, 2.0, 3.0, 0.5]),) if build is WorkspaceError else ()
    criterion = build(rows, 0.1 * np.eye(4), *more)
    best = min(criterion.loss(known(criterion, some)) for some in combinations(range(9), 4))
    assert choose(criterion, 4, 9, rng).loss == pytest.approx(best)


@pytest.mark.parametrize("name", CRITERIA)
def test_exchanges_never_make_it_worse(information, name):
    criterion = CRITERIA[name](information)
    first, losses = one_by_one(criterion, 20, 72)
    chosen, loss = exchange(criterion, first)
    assert loss <= losses[-1] + 1e-9 * abs(losses[-1])
    assert loss == pytest.approx(criterion.loss(known(criterion, chosen)), rel=1e-4)
    assert len(set(chosen)) == 20


def test_a_design_for_free_space_beats_every_random_choice(information):
    rng = np.random.default_rng(1)
    chosen = choose(CRITERIA["free-space"](information), 30, 72, rng).poses
    drawn = [information.free_space_m(information.of(rng.choice(72, 30, replace=False))) for _ in range(50)]
    assert information.free_space_m(information.of(chosen)) < 0.9 * min(drawn)


def test_each_criterion_is_best_by_its_own_measure(information):
    rng = np.random.default_rng(1)
    found = {name: choose(CRITERIA[name](information), 20, 72, rng).poses for name in ("free-space", "d", "o3")}
    for name in found:
        criterion = CRITERIA[name](information)
        losses = {other: criterion.loss(known(criterion, poses)) for other, poses in found.items()}
        assert losses[name] <= min(losses.values()) + 1e-3 * abs(losses[name])
