"""The search finds the light from where there is none, in both orders."""

import numpy as np
import pytest

from acquisition.centring.search import Found, Search
from benchmarks.centring import run_search


def test_finds_both_faces_from_no_light(rig, plain_rig) -> None:
    runs = run_search(rig, plain_rig, cases=2, seed=11)
    assert [run.found for run in runs] == [Found.BOTH] * 2


@pytest.mark.parametrize("first", [1, pytest.param(2, marks=pytest.mark.endure)])  # both orders find, above
def test_says_so_when_there_is_nothing_to_find(rig, bench_of, first: int) -> None:
    from calibeam.learner import FittedLearner

    bench, learner = bench_of(1), FittedLearner(rig)
    bench.place_fixture(0)  # taken away
    search = Search(bench, learner.arm, learner.optics, learner.T_base_fixture(1), first)
    result = search.run(bench.standing_rad)
    assert result.found is Found.NOTHING
    assert result.motions > 100
    assert not np.isfinite(result.look.spots_m()).any()
