"""How an examination ended: no ending without what belongs to it, and no verdict beyond what was examined."""

import msgspec
import pytest

from acquisition.recording.examination import (
    Examination,
    ExaminationRecord,
    all_examined,
    examined_names,
    not_examined,
    not_examined_lines,
)

LAG = Examination("following error", ("cmd", "q"), "record set-points")
SLIPS = Examination("slips", ("enc",), "record ten stands")
FOUND = LAG.found("joint 1 is 10 ms behind", "joint1")
NOTHING = LAG.nothing(1e-5, "s", "joint2")
LEFT = SLIPS.not_examined("too few stands", "joint3")
OUT_OF_PLACE = SLIPS.not_examined("no encoders", expected=False)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"outcome": "found"}, "found, but not what"),
        ({"outcome": "nothing found"}, "no detection limit"),
        ({"outcome": "nothing found", "unit": "rad", "reason": "it is so"}, "no detection limit"),
        ({"outcome": "not examined", "reason": "too short"}, "no reason or no remedy"),
        ({"outcome": "not examined", "remedy": "record more"}, "no reason or no remedy"),
    ],
)
def test_a_record_without_what_belongs_to_its_ending_is_refused(fields, says):
    with pytest.raises(ValueError, match=f"^slips: .*{says}"):
        ExaminationRecord("slips", **fields)
    with pytest.raises(msgspec.ValidationError, match=says):  # of a file, too
        msgspec.json.decode(msgspec.json.encode({"what": "slips"} | fields), type=ExaminationRecord)


@pytest.mark.parametrize("record", [FOUND, NOTHING, LEFT, OUT_OF_PLACE, LAG.nothing(None, "", says="one row in ten")])
def test_a_whole_record_is_written_and_read_back(record):
    assert msgspec.json.decode(msgspec.json.encode(record), type=ExaminationRecord) == record


@pytest.mark.parametrize(
    ("records", "whole"),
    [
        ((), False),
        ((OUT_OF_PLACE,), False),
        ((LEFT,), False),
        ((NOTHING, OUT_OF_PLACE), True),
        ((FOUND, NOTHING), True),
        ((FOUND, NOTHING, LEFT), False),
    ],
)
def test_all_is_examined_only_where_something_was_and_nothing_expected_is_left(records, whole):
    assert all_examined(records) is whole


def test_what_was_expected_comes_first_among_what_was_not_examined():
    assert not_examined((OUT_OF_PLACE, NOTHING, LEFT)) == (LEFT, OUT_OF_PLACE)
    assert examined_names((OUT_OF_PLACE, NOTHING, FOUND, LEFT)) == ("following error",)


def test_places_of_one_reason_share_a_line():
    records = (LEFT, SLIPS.not_examined("too few stands", "joint5"), OUT_OF_PLACE, NOTHING)
    assert list(not_examined_lines(records)) == [
        "not examined: slips (joint3, joint5): too few stands; record ten stands",
        "not examined: slips: no encoders; record ten stands",
    ]
