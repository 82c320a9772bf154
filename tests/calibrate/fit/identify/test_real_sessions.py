"""Real robots before real trackers: no arm predicts better, no blunder where none is, every made one found.

The unseen error as published is in tests/golden/test_real_robots.py.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.fit.held_out.held_out import held_out
from calibrate.fit.held_out.splits import at_random
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.rounds import settled_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.solvers import solve
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.parameters import hold, plausible_sizes
from tests.calibrate.fit.identify.conftest import changed

POSITION = ("x_m", "y_m", "z_m")


def run(recording, samples=None, share=0.0):
    samples = recording.samples if samples is None else samples
    return identify(recording.rig, samples, rng=np.random.default_rng(1), held_out_share=share)


def unseen_rms_m(recording, splits=20):
    """(split,) rms length of the error on a fifth of the rows, each time another fifth, predicted from the others."""
    instruments = instruments_for_fit(recording.rig, recording.samples)
    fitted = settled_fit(instruments.weighting, instruments.start)
    problem = fitted.problem.blocks[0].with_parameters(fitted.fit.parameters)

    def length(part, theta):
        return np.linalg.norm(part.misfit(theta), axis=1)

    each = (at_random(problem.rows, np.random.default_rng(seed)) for seed in range(splits))
    return np.array([held_out(problem, split, fitted.fit.theta, length).rms for split in each])


def best_of_all_arms_m(recording):
    """rms over all rows of the arm (all of five errors a link, tracker, target) that fits these very rows best."""
    problem = instruments_for_fit(recording.rig, recording.samples).weighting.measured[0].problem
    sizes = plausible_sizes(problem.parameters)
    theta = np.zeros(len(sizes))
    for _ in range(8):
        rows = (problem.chain.jacobian(theta, problem.q_rad) * sizes).reshape(-1, len(sizes))
        theta -= sizes * np.linalg.lstsq(rows, problem.misfit(theta).ravel(), rcond=1e-10)[0]
    return float(np.sqrt(np.mean(np.sum(problem.misfit(theta) ** 2, axis=1))))


# Beside the data stand 0.449, 0.421 and 0.397 mm, each of one split that is not told. The mean over 20 splits, which
# scatter by 2 to 4 %, is below that for a and 0.6 % above for d. For b it is 6 % above, and no kinematic model can do
# better: the best arm fitted to the unseen rows as well leaves 0.441 mm (docs/decisions/0007).
FIGURES_M = {"ur10-leica-a": 0.449e-3, "ur10-leica-b": 0.421e-3, "ur10-leica-d": 0.397e-3}
DRAWN_M = {"ur10-leica-a": 0.8e-3, "ur10-leica-b": 1.0e-3, "ur10-leica-d": 0.7e-3}


OF_B = pytest.mark.parametrize(  # another one: daily in tests/golden/test_real_robots.py
    "name", [pytest.param(name, marks=() if name.endswith("b") else pytest.mark.endure) for name in FIGURES_M]
)


@OF_B
def test_a_ur10_before_a_tracker_of_unknown_place_is_predicted_as_well_as_by_the_best_of_all_arms(real, name):
    """Unknowns cost (1 + p/n) on unseen rows: 1.3 % for the 24 of the 632 rows of d, less for the others."""
    recording = real(name)
    assert recording.rig.device is None
    assert unseen_rms_m(recording).mean() <= 1.015 * best_of_all_arms_m(recording)


@pytest.mark.endure  # daily: that no arm predicts b better, above
def test_the_published_error_of_b_is_of_a_lucky_split_which_no_arm_reaches_on_all_rows(real):
    recording, figure = real("ur10-leica-b"), FIGURES_M["ur10-leica-b"]
    rms = unseen_rms_m(recording, 60)
    assert best_of_all_arms_m(recording) > 1.04 * figure
    assert rms.min() <= figure < rms.mean() <= 1.06 * figure


@pytest.mark.endure  # daily: tests/golden/test_real_robots.py
@pytest.mark.parametrize("name", FIGURES_M)
def test_the_identification_tells_the_unseen_error_and_finds_no_gross_error_in_a_good_session(real, name):
    result = run(real(name), share=0.2)
    unseen = result.held_out[0]
    assert "random" in unseen.split
    assert unseen.rms_distance_before_m > DRAWN_M[name]
    assert unseen.rms_distance_after_m < 1.12 * FIGURES_M[name]  # three times the scatter of one split
    assert result.blunders == ()


@pytest.mark.endure  # daily: unseen poses of this arm, in tests/golden/test_real_robots.py
def test_axis_4_of_the_ur5_is_11_6_mrad_out_of_parallel_to_axis_3_in_every_part_of_the_session(real):
    """So far, that a real arm is doubted first: nothing else in the model takes its place (docs/decisions/0007)."""
    recording = real("ur5-tracker")
    q4, q5 = recording.samples.column("q4_rad"), recording.samples.column("q5_rad")
    parts = [q4 < np.median(q4), q4 >= np.median(q4), q5 < np.median(q5), q5 >= np.median(q5)]
    for part in parts:
        result = run(recording, recording.samples.take(np.flatnonzero(part)))
        twist = next(e for e in result.estimates if e.name == "link3.twist")
        assert twist.value == pytest.approx(11.6e-3, abs=3e-4)
    instruments = instruments_for_fit(recording.rig, recording.samples)
    problem = settled_fit(instruments.weighting, instruments.start).problem
    parallel = solve(problem.with_parameters(hold(problem.parameters, ["link3.twist"])), start=instruments.start)
    misfit = problem.blocks[0].misfit(parallel.theta)
    assert np.sqrt(np.mean(np.sum(misfit**2, axis=1))) > 0.4e-3


@pytest.mark.endure  # daily: several kinds at once, in test_blunders_in_sessions.py
def test_gross_errors_made_in_the_ur5_session_are_found_and_no_others(real):
    recording = real("ur5-tracker")
    samples = recording.samples
    x, q3 = samples.column("x_m").copy(), samples.column("q3_rad").copy()
    x[100] += 0.05
    q3[500] += 0.1
    made = changed(samples, x_m=x, q3_rad=q3)
    xyz = np.stack([made.column(c) for c in POSITION], axis=1)
    xyz[600:700] = Rotation.from_rotvec([0.0, 0.0, 2e-3]).apply(xyz[600:700])
    xyz[600:700, 0] += 0.003
    result = run(recording, changed(made, **dict(zip(POSITION, xyz.T, strict=True))))
    assert {(b.kind, b.column, b.rows) for b in result.blunders} == {
        (GrossErrorKind.WRONG_VALUE, "x_m", (100,)),
        (GrossErrorKind.WRONG_VALUE, "q3_rad", (500,)),
        (GrossErrorKind.OTHER_SESSION, "x_m, y_m, z_m", tuple(range(600, 700))),
    }
    assert result.instruments[0].rms_distance_after_m < 0.115e-3
