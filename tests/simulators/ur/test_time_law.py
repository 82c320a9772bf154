import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.ur.moves import trapezoid

positive = st.floats(1e-3, 1e2)


@given(distance=st.just(0.0) | st.floats(1e-9, 1e2), speed=positive, acceleration=positive)
def test_it_ends_where_it_should_and_keeps_both_limits(distance: float, speed: float, acceleration: float) -> None:
    law = trapezoid(distance, speed, acceleration)
    assert law.at(law.duration_s)[0] == distance
    for share in (0.1, 0.25, 0.5, 0.75, 0.9):
        way, rate, change = law.at(share * law.duration_s)
        assert 0.0 <= way <= distance * (1.0 + 1e-9)
        assert rate <= speed * (1.0 + 1e-9)
        assert abs(change) <= acceleration
        mirrored = law.at((1.0 - share) * law.duration_s)[0]
        assert way + mirrored == pytest.approx(distance, abs=1e-9 * (1.0 + distance))


@pytest.mark.parametrize("distance", [5e-324, 1e-300])
def test_a_way_too_short_to_take_any_time_still_ends_where_it_should(distance: float) -> None:
    law = trapezoid(distance, 1.0, 2.0)
    assert law.at(law.duration_s) == (distance, 0.0, 0.0)


def test_a_long_way_takes_distance_over_speed_plus_one_ramp() -> None:
    assert trapezoid(2.0, 1.0, 4.0).duration_s == pytest.approx(2.0 + 0.25)


def test_a_short_way_never_reaches_the_speed() -> None:
    law = trapezoid(0.01, 1.0, 4.0)
    assert law.cruise_s == 0.0
    assert law.at(law.ramp_s)[1] == pytest.approx((0.01 * 4.0) ** 0.5)


@pytest.mark.parametrize("numbers", [(-1.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, float("nan"))])
def test_nonsense_is_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        trapezoid(*numbers)
