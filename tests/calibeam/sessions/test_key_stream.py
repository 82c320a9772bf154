"""What terminals send for keys without a letter is no letter, however it is cut into reads; what is typed is kept."""

import pytest

from calibeam.sessions.keys import KeyStream

SEQUENCES = {
    "up": "\x1b[A",
    "home": "\x1b[H",
    "F1 to F4": "\x1bOP\x1bOQ\x1bOR\x1bOS",
    "up for applications": "\x1bOA",
    "F5": "\x1b[15~",
    "delete with shift": "\x1b[3;2~",
    "F3 with control": "\x1b[1;5R",
    "F1 of the Linux console": "\x1b[[A",
    "insert of rxvt": "\x1b[2$",
    "mouse wheel as xterm tells it": "\x1b[<64;17;5M",
    "three arrows": "\x1b[A\x1b[A\x1b[B",
}


@pytest.mark.parametrize("sequence", SEQUENCES.values(), ids=SEQUENCES.keys())
def test_it_is_no_key_in_one_read_or_in_two(sequence) -> None:
    for cut in range(len(sequence) + 1):
        stream = KeyStream()
        assert stream.keys(sequence[:cut]) + stream.keys(sequence[cut:]) == ""
        assert stream.keys(" ar") == " ar"


def test_a_mouse_of_the_old_kind_whose_place_looks_like_letters() -> None:
    assert KeyStream().keys("\x1b[M ra h") == " h"


@pytest.mark.parametrize("begun", ["\x1b", "\x1b\x1b", "\x1b[", "\x1b[1;", "\x1bO"])
def test_an_escape_that_is_alone_or_torn_does_not_swallow_a_pause(begun) -> None:
    stream = KeyStream()
    assert stream.keys(begun) == ""
    assert stream.keys(" ").endswith(" ")


def test_behind_a_lone_escape_every_key_counts() -> None:
    stream = KeyStream()
    assert stream.keys("\x1b") + stream.keys("h") + stream.keys("\x1ba") == "ha"
