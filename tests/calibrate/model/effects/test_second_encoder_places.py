"""Every place at a joint with two encoders is read back from a term's name, also where one name ends with another."""

from types import SimpleNamespace

import pytest

from calibrate.model.effects.second_encoders import PLACES, placed


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("before", ["", "weighed, "])
def test_place_by_its_name(place, before):
    assert placed(SimpleNamespace(variant=before + place)) == place


def test_none_where_a_term_stands_as_listed():
    assert placed(SimpleNamespace(variant="weighed")) == ""
