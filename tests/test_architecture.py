"""The figures of the house never get worse; `python -m tests.architecture` prints them with their targets."""

import pytest

from tests.architecture import chain, figures, lengths


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.what.replace(" ", "_"))
def test_a_figure_is_no_worse_than_today(figure):
    value = figure.count()
    assert value <= figure.today, f"{value} {figure.what}, at most {figure.today}"


def test_most_rooms_can_be_finished_and_no_import_turns_in_a_circle():
    files = lengths()
    assert files[len(files) // 2] >= 100  # the target is 120 to 220
    assert len(chain()) == len(set(chain()))
