"""Twenty sessions, and sixty: as many 95 % intervals hold the truth as chance allows."""

import pytest
from scipy.stats import binom

from benchmarks import coverage


@pytest.fixture(autouse=True)
def _one_bench(monkeypatch, bench):
    monkeypatch.setattr(coverage, "Bench", lambda _: bench)


@pytest.mark.parametrize("sessions", [20, pytest.param(60, marks=pytest.mark.endure)])
def test_intervals_keep_their_word(request, sessions):
    tally = coverage.run(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml", sessions=sessions, seed=7)
    assert tally.failed == 0
    assert {key[0] for key in tally.stated} == {"tracker", "dual PSD"}
    stated, held = sum(tally.stated.values()), sum(tally.held.values())
    # members of a session share its noise: a sixth of the intervals count as independent, about four a session
    low, high = binom.ppf([0.001, 0.999], stated // 6, coverage.LEVEL) / (stated // 6)
    assert low <= held / stated <= high


def test_what_is_not_determined_is_not_counted(request):
    tally = coverage.run(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml", sessions=2, seed=8)
    assert tally.stated["dual PSD", "joint zero"] == 4  # joint 1 turns with the fixture, joint 6 with the laser
    assert tally.stated["tracker", "device yaw"] == 0  # joint 1 turns with the device
