"""The mix of cases: honest shares, seeds that nobody has looked at, names that give nothing away."""

from collections import Counter

from calibeam.prove.scenario import DEVELOPMENT, KINDS, SHARES, Mix, scenario


def test_at_least_a_third_is_not_one_effect_in_white_noise() -> None:
    drawn = Counter(scenario(Mix(), 1, number, 0).kind for number in range(600))
    assert set(drawn) == set(KINDS)
    assert drawn["one"] < 0.7 * 600
    assert abs(sum(SHARES[kind] for kind in KINDS) - 1.0) < 1e-12


def test_no_case_is_drawn_from_a_seed_of_development() -> None:
    assert all(scenario(Mix(), 3, number, 0).wanted.seed >= DEVELOPMENT for number in range(200))


def test_a_name_says_nothing_of_a_case() -> None:
    assert {scenario(Mix(), 5, 7, attempt).name for attempt in range(3)} == {"case-0007"}


def test_the_same_seed_draws_the_same_cases() -> None:
    assert [scenario(Mix(), 5, n, 0) for n in range(20)] == [scenario(Mix(), 5, n, 0) for n in range(20)]
    assert [scenario(Mix(), 5, n, 0) for n in range(20)] != [scenario(Mix(), 6, n, 0) for n in range(20)]


def test_another_attempt_keeps_kind_and_size() -> None:
    first, second = scenario(Mix(), 5, 3, 0), scenario(Mix(), 5, 3, 1)
    assert (first.kind, first.wanted.family, first.wanted.enr) == (second.kind, second.wanted.family, second.wanted.enr)
    assert first.wanted.seed != second.wanted.seed


def test_null_cases_have_every_noise() -> None:
    mix = Mix(kinds=("none",))
    assert {scenario(mix, 1, n, 0).wanted.noise for n in range(60)} == {"white", "heavy", "wandering"}
