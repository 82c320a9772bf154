"""A fit of all geometry, started at the drawing: it ends at the noise, or above it by the effect over noise."""

import numpy as np
import pytest

from simulators.conceal.case import Case, conceal
from simulators.conceal.effect_over_noise import in_sigmas, list_deviations
from simulators.conceal.observe import observe
from simulators.conceal.rig import TrueRig
from simulators.conceal.wanted import Family, Wanted

STEP = 1e-6
ROUNDS = 7  # Gauss-Newton, each held back to the drawing's sigma


def left_over_rms(case: Case) -> float:
    """Rms misfit in sigmas per degree of freedom after fitting every deviation that there is."""

    def predict(rig: TrueRig) -> np.ndarray:
        wire = case.wanted.family == "wire"
        values_m = observe(rig, case.table.scene, (), case.reading_rad, wire=wire).values_m
        return np.concatenate((values_m.ravel() / case.sigma_m, in_sigmas(rig, case.stated.distances)))

    lengths = [one.length_m / one.sigma_m for one in case.stated.distances]
    measured = np.concatenate((case.values_m.ravel() / case.sigma_m, lengths))
    rig, rank = case.drawn.nominal, 0
    for _ in range(ROUNDS):
        deviations = list_deviations(rig, case.drawn.spread)
        slope = np.stack(
            [
                (predict(one.apply(rig, STEP)) - predict(one.apply(rig, -STEP))) * one.sigma / (2.0 * STEP)
                for one in deviations
            ],
            axis=1,
        )
        rank = int(np.sum(np.linalg.svd(slope, compute_uv=False) > 1.0))
        held = np.vstack((slope, np.eye(len(deviations))))
        missing = np.concatenate((measured - predict(rig), np.zeros(len(deviations))))
        for one, move in zip(deviations, np.linalg.lstsq(held, missing, rcond=None)[0], strict=True):
            rig = one.apply(rig, float(move * one.sigma))
    misfit = (measured - predict(rig))[: case.values_m.size]
    return float(np.sqrt(np.sum(misfit**2) / (misfit.size - rank)))


@pytest.mark.parametrize("family", ["dual-psd", "tracker", "wire"])
def test_without_a_defect_the_drawing_fits_down_to_the_noise(family: Family) -> None:
    assert left_over_rms(conceal(Wanted(family, seed=51, samples=100, places=3))) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("family", ["dual-psd", "tracker"])
def test_effect_over_noise_is_what_a_fit_leaves(family: Family) -> None:
    """Two independent parts add in squares: misfit^2 = 1 + ENR^2, the ENR here per degree of freedom."""
    case = conceal(Wanted(family, seed=52, samples=100, places=3, defects=("encoder-eccentricity",), enr=3.0))
    assert case.hidden[0].enr == pytest.approx(3.0, rel=0.02)
    assert left_over_rms(case) == pytest.approx(np.sqrt(1.0 + 3.0**2), rel=0.15)
