"""Single-axis runs in long recordings: rows are looked at a few times each, however many there are."""

from typing import Any

import numpy as np
import pytest

from calibrate.tool_axes.circle import single_axis_segments

MANY = 4000


def _turns(rng: np.random.Generator) -> Any:
    return rng.uniform(-2.0, 2.0, (MANY, 3))


def _stands(rng: np.random.Generator) -> Any:
    return np.zeros((MANY, 3))


@pytest.mark.parametrize("readings", [_turns, _stands])
def test_a_row_is_looked_at_a_bounded_number_of_times(readings: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    delete = np.delete

    def counted(array: Any, *given: Any, **more: Any) -> Any:
        seen.append(len(array))
        return delete(array, *given, **more)

    monkeypatch.setattr(np, "delete", counted)
    assert single_axis_segments(readings(np.random.default_rng(1))) == ()
    assert sum(seen) < 3 * 80 * MANY


@pytest.mark.parametrize("rows", [5, 6, 7, 8, 9])
def test_a_few_rows_of_which_every_joint_moves_are_no_run(rows: int) -> None:
    assert single_axis_segments(np.random.default_rng(rows).uniform(-2.0, 2.0, (rows, 6))) == ()


def test_a_turn_after_a_long_stand_is_found() -> None:
    q_rad = np.zeros((600, 3))
    q_rad[500:550, 2] = np.linspace(0.0, 1.0, 50)
    q_rad[550:, 2] = 1.0
    (found,) = single_axis_segments(q_rad)
    assert found.joint == 3
    assert set(range(499, 550)) <= set(found.rows.tolist())
