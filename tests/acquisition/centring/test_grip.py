"""Near a singular wrist: the roll about the beam that brings the grip back, and leaves the beam where it is."""

import numpy as np

from acquisition.centring.registered import LEAST_GRIP, grip, rolled
from acquisition.centring.strategies import MeasuredStrategy
from benchmarks.centring import random_start
from calibeam.learner import FittedLearner

STAND_OFF_M = 0.2
SINGULAR_RAD = np.radians([187.0, -70.4, 127.9, -121.4, 164.6, 194.8])  # 15 deg from a stretched wrist


def test_a_roll_brings_the_grip_back_and_holds_the_line(rig) -> None:
    arm = FittedLearner(rig).arm
    assert grip(arm, SINGULAR_RAD, STAND_OFF_M) < LEAST_GRIP
    q_rad = SINGULAR_RAD
    for _ in range(3):
        q_rad = q_rad + rolled(arm, q_rad, STAND_OFF_M)
    assert grip(arm, q_rad, STAND_OFF_M) > 1.5 * LEAST_GRIP
    (before_m, before), (after_m, after) = arm.beam(SINGULAR_RAD), arm.beam(q_rad)
    np.testing.assert_allclose(after_m, before_m, atol=1e-3)
    np.testing.assert_allclose(after, before, atol=3e-3)


def test_with_grip_enough_nothing_is_rolled(rig) -> None:
    arm = FittedLearner(rig).arm
    assert not rolled(arm, np.array(rig.motion.home_rad), STAND_OFF_M).any()


def test_a_probe_that_was_shortened_teaches_what_a_whole_one_does(rig, plain_rig) -> None:
    start = random_start(rig, plain_rig, 0, np.random.default_rng(701))
    columns = []
    for share in (1.0, 0.25):
        strategy = MeasuredStrategy(start.learner.arm, start.learner.optics, start.T_guess, start.first)
        start.bench.move(start.q_rad)
        strategy.learn(start.q_rad, start.bench.look(0.05).spots_m())
        q_rad = start.q_rad + share * strategy.propose(np.zeros(4)).step_rad
        start.bench.move(q_rad)
        strategy.learn(q_rad, start.bench.look(0.05).spots_m())
        columns.append(strategy._columns[0])
    whole, quarter = columns
    assert np.linalg.norm(quarter - whole) < 0.1 * np.linalg.norm(whole)
