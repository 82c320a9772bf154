"""Sign of x and scale of the sum, measured from spots at known places, whatever way a unit is wired."""

import numpy as np
import pytest

from drivers.psd_kpa101.pair import counts_of
from drivers.psd_kpa101.selfcheck import CheckStatus, check_unit

PLACES_M = np.array([(x, y) for x in (-3e-3, 0.0, 3e-3) for y in (-3e-3, 0.0, 3e-3)])
HALF_M = 5e-3
OFFSET_M = np.array([7e-3, -2e-3])


@pytest.fixture
def counts_at(in_memory):
    """Mean counts of unit 1 with its spot at each place; the unit is wired as told."""

    def read(x_sign: int, sum_full_scale_v: float, light_a: float = 40e-6, places_m=PLACES_M) -> np.ndarray:
        in_memory.bench.verbs["psd.wiring"](unit=1, x_sign=x_sign, sum_full_scale_v=sum_full_scale_v)
        in_memory.world.light_a[0] = light_a
        in_memory.psd.connect()
        rows = []
        for place in places_m:
            in_memory.world.spots_m[0] = tuple(place)
            in_memory.psd.read(1.0)
            rows.append(counts_of(in_memory.psd.read(1.0).values, 1).mean(axis=0))
        return np.array(rows)

    return read


@pytest.mark.parametrize(("x_sign", "scale_v"), [(-1, 10.0), (1, 10.0), (-1, 40.0)])
def test_what_is_measured_is_how_the_unit_is_wired(counts_at, x_sign, scale_v):
    check = check_unit(PLACES_M + OFFSET_M, counts_at(x_sign, scale_v), HALF_M)  # the stage has a zero of its own
    assert check.status is CheckStatus.GOOD
    assert (check.x.sign, check.y.sign) == (x_sign, 1)
    value_v, sigma_v = check.sum_full_scale_v
    assert abs(value_v - scale_v) < max(5.0 * sigma_v, 1e-3 * scale_v)
    assert sigma_v < 1e-3 * scale_v


def test_places_that_do_not_tell_give_no_number(counts_at):
    counts = counts_at(-1, 10.0)
    standing = np.zeros_like(PLACES_M)
    assert check_unit(standing, counts, HALF_M).status is CheckStatus.NOT_MOVED
    assert check_unit(standing, counts, HALF_M).sum_full_scale_v is None
    assert check_unit(PLACES_M, np.tile(counts[4], (9, 1)), HALF_M).status is CheckStatus.NOT_MOVED
    assert check_unit(PLACES_M[:, ::-1] * [1.0, 0.3], counts, HALF_M).status is CheckStatus.AXES_EXCHANGED
    assert check_unit(PLACES_M[:2], counts[:2], HALF_M).status is CheckStatus.TOO_FEW_PLACES
    assert check_unit(PLACES_M, np.zeros((9, 3)), HALF_M).status is CheckStatus.TOO_FEW_PLACES
    along_x = PLACES_M * [1.0, 0.0]
    assert check_unit(along_x, counts, HALF_M).status is CheckStatus.NOT_MOVED


def test_noise_shows_as_uncertainty():
    rng = np.random.default_rng(4)
    true = np.column_stack([-PLACES_M[:, 0] / HALF_M * 4.0 / 10 * 32767, PLACES_M[:, 1] / HALF_M * 4.0 / 10 * 32767])
    counts = np.column_stack([true, np.full(9, 4.0 / 10 * 65535)])
    checks = [check_unit(PLACES_M, counts + 30.0 * rng.standard_normal((9, 3)), HALF_M) for _ in range(300)]
    found = np.array([check.sum_full_scale_v for check in checks])
    assert np.sqrt((found[:, 1] ** 2).mean()) == pytest.approx(found[:, 0].std(), rel=0.2)
    assert found[:, 0].mean() == pytest.approx(10.0, abs=5 * found[:, 0].std() / 17)


@pytest.mark.parametrize("shape", [(9, 2), (8, 3)])
def test_shapes_that_do_not_fit(shape):
    with pytest.raises(ValueError, match="give"):
        check_unit(PLACES_M, np.zeros(shape), HALF_M)
