"""Parameter names in the words of who stands beside the robot."""

import pytest

from calibrate.fit.rank.observability import in_plain_words


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("joint6.zero", "the zero of joint 6"),
        ("link2.offset + device z", "the offset of link 2 and where the measuring device stands (z)"),
        ("placement x, y, yaw", "where the fixture stands (x, y, yaw)"),
        ("seat2.z", "where cone 2 is (z)"),
        ("seat x, y", "where the cones are (x, y)"),
        ("tool.z", "where the target sits on the flange (z)"),
        ("placement3.roll", "where fixture station 3 is (roll)"),
        ("gravity.joint2", "gravity.joint2"),
    ],
)
def test_names_become_words(words, plain):
    assert in_plain_words(words) == plain
