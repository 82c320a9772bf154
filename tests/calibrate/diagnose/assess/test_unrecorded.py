"""Scatter without a column: whose lever it follows, which missing column would do it, and what is innocent."""

import numpy as np

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.joint_scatter import innocent
from calibrate.diagnose.assess.unrecorded import unrecorded
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.noise_law import noise_law
from calibrate.model.effects.term import Missing

SEEDS = 6
APPROACH = Missing("approach", "approach1 ...", "backlash")
SPEED = Missing("qd", "qd1_rad_s ...", "latency")


def scattered(world, rng, joints, moving, sizes=1.0):
    """A session whose joints turn by chance, at some of the samples; `sizes` of each joint, alike if one number."""
    drawn = sizes * rng.normal(size=(len(moving), len(joints))) * moving[:, None]

    def turned(drivers):
        return sum(world.at_joint(j, lambda _, x=drawn[:, c]: x)(drivers) for c, j in enumerate(joints))

    return world.session(rng, [(turned, 4.0)])


def asked(world, seed, joints, share, missing):
    rng = np.random.default_rng(seed)
    n = len(world.session(rng).drivers.t_s)
    return unrecorded(Bench(scattered(world, rng, joints, rng.random(n) < share)), rng, missing)


def test_the_missing_column_is_named_at_its_joint(world):
    found = [asked(world, seed, (3,), 2.0, (APPROACH, SPEED)) for seed in range(SEEDS)]
    right = [f for f in found if f is not None and f.port.where == "joint3.angle" and f.missing == (APPROACH,)]
    assert len(right) >= 5


def test_joints_that_do_not_repeat_well_lack_no_driver(world):
    joints = tuple(range(1, world.session(np.random.default_rng(0)).drivers.n_joints + 1))
    found = [asked(world, seed, joints, 2.0, (APPROACH, SPEED)) for seed in range(SEEDS)]
    assert sum(f is not None for f in found) <= 1


def test_joints_that_repeat_unequally_well_lack_no_driver(world):
    """The worst up to three times worse than the best, four times the instrument's noise."""
    found = []
    for seed in range(SEEDS + 2):
        rng = np.random.default_rng(seed)
        every = tuple(range(1, world.session(rng).drivers.n_joints + 1))
        sizes = np.exp(rng.uniform(0.0, np.log(limits.UNEQUAL_JOINTS), len(every)))
        session = scattered(world, rng, every, np.ones(world.samples), sizes)
        found.append(unrecorded(Bench(session), rng, (APPROACH, SPEED)))
    assert sum(f is not None for f in found) <= 1


def test_joints_that_scatter_at_some_samples_only_were_moving():
    rng = np.random.default_rng(5)
    joints = rng.normal(size=(6, 300, 3))
    moving = (rng.random(300) < 0.5) * rng.uniform(0.3, 1.5, 300)
    turned = rng.normal(size=(300, 6)) * moving[:, None]
    raw = rng.normal(size=(300, 3)) + np.einsum("jok,oj->ok", joints, turned)
    assert innocent(raw, joints).restless > limits.RESTLESS
    heavy = rng.standard_t(3.0, (300, 1)) * rng.normal(size=(300, 3))
    assert innocent(heavy, joints).restless < limits.RESTLESS


def test_innocent_scatter_is_whitened():
    rng = np.random.default_rng(4)
    joints = rng.normal(size=(3, 400, 4))
    raw = rng.normal(size=(400, 4)) + 2.0 * np.einsum("jok,oj->ok", joints, rng.normal(size=(400, 3)))
    base = innocent(raw, joints)
    white = np.einsum("oij,oj->oi", base.whitener, raw)
    assert base.through_joints
    assert np.allclose(white.T @ white / 400, np.eye(4), atol=0.2)
    assert base.restless < limits.RESTLESS


def test_a_step_of_the_fit_is_longer_than_the_least_squares_step(world):
    """Gaussian data under the t law: curvature E[psi'] / E[w] below one, above its value for data of that law."""
    found = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        bench = Bench(world.session(rng))
        found.append(noise_law(bench.state.rows, bench.sight, bench.state.drivers.t_s, rng).curvature)
    assert 0.7 < np.mean(found) < 0.95
