"""A long session is searched on fewer samples."""

import numpy as np

from calibrate.diagnose import limits
from calibrate.diagnose.assess.assessment import thinned
from tests.calibrate.diagnose.conftest import World

SAMPLES = limits.MOST_SEARCH_ROWS // World().channels  # of so many rows each


def test_a_short_session_is_searched_whole():
    rng = np.random.default_rng(0)
    session = World(samples=120).session(rng)
    assert thinned(session, rng) is session


def test_of_a_long_session_visits_of_one_pose_stay_together():
    rng = np.random.default_rng(1)
    session = World(samples=SAMPLES + 150).session(rng)
    some = thinned(session, rng)
    kept = np.unique(some.rows.sample[some.rows.data])
    assert 0.9 * SAMPLES <= len(kept) <= SAMPLES
    repeat = session.drivers.repeat
    for group in np.unique(repeat[repeat >= 0]):
        assert (
            np.isin(np.flatnonzero(repeat == group), kept).all()
            != np.isin(np.flatnonzero(repeat == group), kept, invert=True).all()
        )


def test_what_is_kept_is_drawn_over_the_whole_session():
    rng = np.random.default_rng(2)
    session = World(samples=2 * SAMPLES).session(rng)
    t = session.drivers.t_s
    kept = thinned(session, rng).rows.sample
    shares = np.histogram(t[np.unique(kept[kept >= 0])], bins=4, range=(t.min(), t.max()))[0]
    assert np.all(shares > 0.2 * SAMPLES)
