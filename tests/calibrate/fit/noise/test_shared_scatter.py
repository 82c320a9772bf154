"""Joints that come to rest off what is reported show in second encoders and in spots alike: one draw, not two."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.noise_of_fit import freedom
from calibrate.diagnose.state.session import session_of
from calibrate.fit.fit_plan import FitPlan
from calibrate.fit.identify.rounds import settled_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.model.effects.term import Accepted
from tests.calibrate.conftest import spot_samples

SEATING_RAD, OWN_RAD, PSD_M, ROWS = 10e-6, 2e-6, 2e-6, 60
SOFT = ("joint2.angle", ("gravity_torque2",), "linear", None, "joint-compliance", "")
BOTH = ("dual-psd", "encoder-difference")
DRAWS = pytest.mark.parametrize("draws", [4, pytest.param(40, marks=pytest.mark.endure)])
HELD = ("link*", "laser*", "psd2*", "placement*")  # known: nothing hides what the joints scatter


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture(scope="module")
def still(sessions, ur5e_exact):
    """A session without any noise."""
    return sessions(3, n=ROWS, truth=ur5e_exact(), joint_noise=0.0, psd_noise=0.0)


@pytest.fixture(scope="module")
def drawn(still):
    """Samples by seed, `own_rad` the noise of second encoders on the links (True) or in front of the gears."""

    def draw(seed, own_rad, on_link=True):
        rng = np.random.default_rng(seed)
        off = SEATING_RAD * rng.standard_normal(still.q_rad.shape)
        link = still.q_rad  # spots are of these angles
        read = (link if on_link else link - off) + own_rad * rng.standard_normal(off.shape)
        table = spot_samples(still, q_rad=link - off)
        noise = {name: PSD_M * rng.standard_normal(ROWS) for name in table.columns if name.startswith("psd")}
        columns = {name: values + noise.get(name, 0.0) for name, values in table.columns.items()}
        return Samples(columns | {f"enc{i + 1}_rad": read[:, i] for i in range(6)}, 6)

    return draw


@pytest.fixture(scope="module")
def one(rig, drawn):
    """The fit of one draw, of encoders on the links."""
    return fitted(rig, drawn(1, OWN_RAD))


def fitted(rig, samples):
    found = instruments_for_fit(rig, samples, FitPlan(schema=1, instruments=BOTH, hold=HELD))
    return settled_fit(found.weighting, found.start)


@pytest.fixture(scope="module")
def geometry(rig, drawn):
    """The same draw as a diagnosis fits it."""
    return fit_geometry(session_of(rig, drawn(1, OWN_RAD)))


def away(fit):
    """What both instruments see, each joint's zero and its encoder's together: squared distance from the truth in
    sigmas, and how many there are."""
    names = [p.name for p in fit.problem.parameters]
    both = np.zeros((6, len(names)))
    for joint in range(1, 7):
        both[joint - 1, [names.index(f"joint{joint}.zero"), names.index(f"encoder{joint}.zero")]] = 1.0
    zeros = [names.index(f"joint{joint}.zero") for joint in range(1, 7)]
    both = both[np.diag(fit.fit.covariance)[zeros] > 0.0]
    values = both @ fit.fit.theta
    return float(values @ np.linalg.solve(both @ fit.fit.covariance @ both.T, values)), len(both)


@DRAWS
@pytest.mark.parametrize("on_link", [True, False])
def test_what_both_instruments_see_is_as_far_off_as_its_covariance_says(rig, drawn, on_link, draws):
    each = [away(fitted(rig, drawn(100 + seed, OWN_RAD, on_link))) for seed in range(draws)]
    total, count = sum(square for square, _ in each), sum(n for _, n in each)
    low, high = chi2.ppf([0.005, 0.995], count)
    assert low < total < high


@DRAWS
def test_a_soft_joint_that_both_see_is_as_far_off_as_its_sigma_says(rig, drawn, draws):
    squares = []
    for seed in range(draws):
        session = session_of(rig, drawn(200 + seed, OWN_RAD))
        fit = fit_geometry(session)
        (term,) = (t for t in fit.candidates() if t.key == SOFT)
        with_term = fit.refitted([Accepted(term, np.zeros(1), np.zeros(len(term.inner)))])
        at = len(session.parameters)
        squares.append(with_term.values[at] ** 2 / with_term.covariance[at, at])
    low, high = chi2.ppf([0.005, 0.995], draws)
    assert low < sum(squares) < high


def correlation(one, other):
    return float(np.sum(one * other) / np.sqrt(np.sum(one**2) * np.sum(other**2)))


def test_whitened_spots_know_nothing_of_the_encoders_of_their_sample(one):
    fit = one
    problem, theta = fit.problem, fit.fit.theta
    block, witnessed = problem.blocks[0], problem.witnessed
    shared = witnessed.added(block, 0, witnessed.problem.misfit(problem.of_block(1, theta)))
    assert abs(correlation(problem.residual_of(0, theta), shared)) < 0.1
    assert abs(correlation(block.residual(problem.of_block(0, theta)), shared)) > 0.8


def test_the_slope_of_whitened_rows_is_the_derivative_of_their_residual(one):
    fit = one
    theta, slope = fit.fit.theta, fit.problem.jacobian(fit.fit.theta)
    for i in np.flatnonzero([p.free for p in fit.problem.parameters]):
        step = np.zeros(len(theta))
        step[i] = 1e-2 * fit.problem.parameters[i].plausible
        change = fit.problem.residual(theta + step) - fit.problem.residual(theta - step)
        assert_allclose(change / (2.0 * step[i]), slope[:, i], atol=1e-4 * np.abs(slope[:, i]).max() + 1e-9)


def test_the_share_is_that_of_the_links(rig, drawn, one, geometry):
    on_link = one.weighting.shares
    in_front = fitted(rig, drawn(1, SEATING_RAD, on_link=False)).weighting.shares
    true = SEATING_RAD**2 / (SEATING_RAD**2 + OWN_RAD**2)
    assert abs(np.mean(on_link[:3]) - true) < 0.12  # the last joints have short levers
    assert np.mean(in_front[:3]) < 0.3
    state = geometry
    assert abs(np.mean(state.noise.shared.share[:3]) - true) < 0.12


def test_joints_scatter_by_what_encoders_have_taken_out_and_by_what_is_left(rig, drawn):
    """Both parts together are the repeatability, as far off as their sigma says; in front of the gear there is none."""
    off = []
    for seed in range(1, 9):
        fit = fitted(rig, drawn(seed, OWN_RAD))
        (taken, taken_sigma), left = (
            fit.weighting.shared_rad(fit.factors),
            fit.weighting.joint_rad * fit.factors.factor[0],
        )
        left_sigma = fit.weighting.joint_rad * fit.factors.factor_sigma[0]
        size = np.hypot(taken, left)
        off.append((size - SEATING_RAD) / (np.hypot(taken * taken_sigma, left * left_sigma) / size))
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.6  # the middle 99 % of what eight draws may come to
    taken, sigma = (fit := fitted(rig, drawn(1, OWN_RAD, on_link=False))).weighting.shared_rad(fit.factors)
    assert taken < 3.0 * sigma


def test_each_instrument_pays_for_what_was_fitted_to_it(geometry):
    """Zeros of the second encoders are all that their rows determine; the rest of geometry is the spots'."""
    fit = geometry
    names = [m.name for m in fit.session.measured]
    counts = np.array([m.problem.observed.size for m in fit.session.measured])
    fitted = dict(zip(names, counts * (1.0 - 1.0 / freedom(fit.problem, fit.values, fit.covariance)), strict=True))
    assert fitted["encoder-difference"] == pytest.approx(6.0, abs=0.6)
    assert fitted["dual-psd"] > 20.0


def test_a_sample_without_an_answer_of_the_encoders_weighs_less(rig, drawn):
    samples = drawn(1, OWN_RAD)
    columns = {name: values.copy() for name, values in samples.columns.items()}
    columns["enc2_rad"][:5] = np.nan
    silent = Samples(columns, 6)
    (spots, _) = fitted(rig, silent).problem.blocks
    sizes = np.sqrt(np.trace(np.linalg.inv(np.swapaxes(spots.whitener, 1, 2) @ spots.whitener), axis1=1, axis2=2))
    assert sizes[:5].min() > 1.5 * np.median(sizes[5:])
    state = fit_geometry(session_of(rig, silent))
    sizes = np.trace(state.scatters[0].covariance, axis1=1, axis2=2)
    assert sizes[:5].min() > 2.0 * np.median(sizes[5:])


def test_nothing_changes_without_second_encoders(rig, drawn):
    samples = drawn(1, OWN_RAD)
    plain = Samples({name: v for name, v in samples.columns.items() if not name.startswith("enc")}, 6)
    found = instruments_for_fit(rig, plain, FitPlan(schema=1))
    assert found.weighting.sharing(found.start, found.weighting.assumed_factors) is found.weighting
    assert found.weighting.problem(found.start).witnessed is None
    assert fit_geometry(session_of(rig, plain)).noise.shared is None
