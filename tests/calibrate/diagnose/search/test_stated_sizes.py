"""Sigmas of stated sizes: by what the readings scatter, and by what stated masses may be off."""

import numpy as np
import pytest

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined, telling_times
from calibrate.diagnose.search.stated_sizes import sandwich, sizes_of
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.loads import states_masses
from calibrate.model.effects.term import Accepted, Size, plain
from tests.calibrate.diagnose.concealed import recording_of

CAUSE = "backlash"


def with_play(world, rng, noise, size):
    """A session in which joint 2 has play of this size, and the term that says so."""
    session = world.session(rng, noise=noise)
    effect = np.einsum("nkj,nj->nk", session.lever, world.at_joint(2, lambda d: d.approach[:, 1])(session.drivers))
    moved = world.with_readings(session, session.readings + size * effect)
    term = next(t for t in session.candidates() if t.physics == CAUSE and t.port.where == "joint2.angle")
    return Bench(moved.refitted([refined(Bench(moved), term, np.zeros(0))]))


WHITE = pytest.param("white", marks=pytest.mark.endure)  # daily: stated sigmas cover, in test_doubt.py


@pytest.mark.parametrize("noise", [WHITE, "heavy"])
def test_the_sandwich_covers_under_heavy_tails_as_under_white_noise(world, noise):
    size, inside = 0.3, 0
    for seed in range(120):
        (found,) = sizes_of(with_play(world, np.random.default_rng(seed), noise, size), 0).values()
        inside += abs(found.value - size) <= 1.96 * found.sigma
    assert 0.89 <= inside / 120 <= 0.99


def test_only_samples_in_a_moved_seat_can_tell_when_it_moved(tmp_path):
    """Seat 2 was touched in the first and the last third only: when it slid in between, nobody can know better."""
    rec = recording_of(tmp_path, family="cones", seed=72, samples=160, places=4)
    t_s, seat = rec.samples.column("t_s"), rec.samples.integers("seat", -1)
    third = (t_s.max() - t_s.min()) / 3.0
    rows = (seat != 2) | (np.abs(t_s - t_s.min() - 1.5 * third) > 0.5 * third)
    bench = Bench(fit_geometry(session_of(rec.rig, rec.samples.take(rows))))
    t_s, seat = t_s[rows], seat[rows]
    term = next(t for t in bench.menu.terms if t.physics == "seat-moved" and t.variant == "seat 2")
    mine = np.unique(t_s[seat == 2])
    gap = int(np.argmax(np.diff(mine)))
    accepted = Accepted(term, np.full(3, 1e-4), np.array([(mine[gap] + mine[gap + 1]) / 2.0]))
    assert np.array_equal(telling_times(bench, term, accepted.inner), mine)
    size = sizes_of(Bench(bench.state.refitted([accepted])), 0)["time_s"]
    assert size.sigma == pytest.approx((mine[gap + 1] - mine[gap]) / np.sqrt(12.0))


def test_a_column_twice_as_long_has_half_the_sigma(world):
    bench = with_play(world, np.random.default_rng(5), "white", 0.3)
    span = bench.gone[0].span
    column = span @ (span.T @ bench.state.columns(bench.state.accepted[0].term, np.zeros(0)))
    one, two = (float(np.sqrt(sandwich(bench, scale * column)[0, 0])) for scale in (1.0, 2.0))
    assert two == pytest.approx(one / 2.0)


def test_a_compliance_is_no_better_known_than_the_masses(tmp_path):
    """Readings tell a turn, not a weight: 15 % of one link's mass is a few per cent of a compliance."""
    rec = recording_of(tmp_path, family="tracker", seed=21, samples=160, defects=("soft-joint",), enr=4.0)
    assert states_masses(rec.rig)
    bench = Bench(fit_geometry(session_of(rec.rig, rec.samples)))
    plain = [t for t in bench.menu.terms if t.physics == "joint-compliance" and t.shape.value == "linear"]
    plain = [t for t in plain if t.variant == ""]
    fits = [Bench(bench.state.refitted([refined(bench, term, np.zeros(0))])) for term in plain[1:3]]
    best = min(fits, key=lambda b: b.bic)
    size = sizes_of(best, 0)["compliance_rad_nm"]
    span, term = best.gone[0].span, best.state.accepted[0].term
    by_scatter = sandwich(best, span @ (span.T @ best.state.columns(term, np.zeros(0))))
    assert size.sigma > np.sqrt(by_scatter[0, 0])
    assert 0.02 * abs(size.value) < size.sigma < 0.4 * abs(size.value)


def test_a_value_that_the_data_do_not_tell_has_no_sigma_that_pretends_it(world):
    rng = np.random.default_rng(7)
    bench = Bench(world.session(rng))
    seen = rng.standard_normal(len(bench.state.rows.residual))
    lines, one, other = np.diag(sandwich(bench, np.stack([rng.permutation(seen), seen, 2.0 * seen], axis=1)))
    assert np.isfinite(lines)
    assert lines > 0.0
    assert np.isinf([one, other]).all()


def test_a_size_without_a_sigma_is_not_reported_in_words_or_file():
    assert "not determined" in plain("shift_x_m", Size(1e-5, np.inf))
