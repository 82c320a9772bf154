"""Lines as instruments print them, and what is refused instead of guessed."""

import math

import pytest

from drivers.tracker.codec import BadLine, LineCodec, LineRefusedError, TargetReading, Units, ascii_lines, json_lines

MM = Units(1e-3)
WITH_STATUS = Units(1e-3, 1e-3, ("0", "OK"))


def test_columns_units_and_status() -> None:
    parse = ascii_lines(("time", "x", "-", "y", "z", "status"), ";", ".", WITH_STATUS)
    assert parse("1500; 2125.0 ;7;-250;.5e3;OK") == TargetReading((2.125, -0.25, 0.5), True, 1.5)
    lost = parse("1510;0;7;0;0;-3")
    assert not lost.good
    assert all(map(math.isnan, lost.position_m))
    assert parse("1520;---;7;---;---;-3").device_s == pytest.approx(1.52)  # without a target some print no numbers


def test_decimal_comma_blanks_and_a_separator_at_the_end() -> None:
    assert ascii_lines(("x", "y", "z"), ";", ",", MM)("1,5;-2,25;1000,0;").position_m == pytest.approx(
        (0.0015, -0.00225, 1.0)
    )
    assert ascii_lines(("x", "y", "z"), " ", ".", MM)("  1.5\t 2   3 ").position_m == pytest.approx(
        (0.0015, 0.002, 0.003)
    )
    assert ascii_lines(("x", "y", "z"), ",", ".", Units(0.0254))("1,2,3").position_m[0] == 0.0254


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("1;2", "2 columns, 4 are declared"),
        ("1;2;3;4;5", "5 columns"),
        ("nan;1;2;3", "'nan' is no number"),
        ("inf;1;2;3", "'inf' is no number"),
        ("1;1_0;2;3", "'1_0' is no number"),
        ("1;1,5;2;3", "'1,5' is no number"),
        ("1;;2;3", "'' is no number"),
        ("1;1e999;2;3", "'1e999' is no number"),
        ("1;2104518;2;3", "x = 2104.52 m, beyond 200 m: is length_unit right"),
    ],
)
def test_lines_that_are_refused(line, says) -> None:
    parse = ascii_lines(("time", "x", "y", "z"), ";", ".", MM)
    with pytest.raises(LineRefusedError, match=says):
        parse(line)


def test_members_of_json() -> None:
    members = {"x": "p.0", "y": "p.1", "z": "p.2", "time": "t", "status": "state.ok", "temperature": "air"}
    parse = json_lines(members, Units(1.0, 1.0, ("true",)))
    line = '{"t": 3.5, "p": [1, 2.5, -3], "state": {"ok": true}, "air": 20.5, "more": null}'
    assert parse(line) == TargetReading((1.0, 2.5, -3.0), True, 3.5, 20.5)
    assert not parse(line.replace("true", "false")).good


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('{"p": [1, 2]}', "no member 'p.2'"),
        ('{"p": {"0": 1}}', "no member 'p.1'"),
        ('{"p": [1, 2, "3"]}', "'3' is no number"),
        ('{"p": [1, 2, true]}', "'True' is no number"),
        ('{"p": [1, 2, NaN]}', "no JSON"),
        ('{"p": [1, 2, 1' + 400 * "0" + "]}", "hundreds of digits"),
        ("[" * 1500, "no JSON"),
        ('{"p": [1, 2,', "no JSON"),
        ("17", "no member"),
    ],
)
def test_json_that_is_refused(line, says) -> None:
    parse = json_lines({"x": "p.0", "y": "p.1", "z": "p.2"}, Units(1.0))
    with pytest.raises(LineRefusedError, match=says):
        parse(line)


@pytest.mark.parametrize(
    ("columns", "separator", "decimal", "good", "says"),
    [
        (("x", "y"), ",", ".", (), "'z' is missing"),
        (("x", "y", "z", "x"), ",", ".", (), "one stands twice"),
        (("x", "y", "z", "azimuth"), ",", ".", (), "'azimuth' is not known"),
        (("x", "y", "z", "status"), ",", ".", (), "needs 'good'"),
        (("x", "y", "z"), ",", ".", ("0",), "'good' a status column"),
        (("x", "y", "z"), ",", ",", (), "cannot be distinguished"),
        (("x", "y", "z"), "-", ".", (), "cannot be distinguished"),
        (("x", "y", "z"), ", ", ".", (), "give one character"),
    ],
)
def test_layouts_that_are_none(columns, separator, decimal, good, says) -> None:
    with pytest.raises(ValueError, match=says):
        ascii_lines(columns, separator, decimal, Units(1e-3, 1.0, good))


def test_the_rest_of_a_line_is_never_a_reading() -> None:
    """Of "1523.2,..." only "23.2,..." may be left: it reads well, and is wrong."""
    parse = ascii_lines(("x", "y", "z"), ",", ".", MM)
    assert LineCodec(parse, midway=True).feed(b"23.2,1,2\n5,6,7\n") == [TargetReading((0.005, 0.006, 0.007), True)]
    pieces = LineCodec(parse, midway=True)
    assert [found for byte in b"23.2,1,2\r\n5,6,7\r\n" for found in pieces.feed(bytes((byte,)))] == [
        TargetReading((0.005, 0.006, 0.007), True)
    ]


def test_a_line_without_end_is_named_once_and_not_kept() -> None:
    codec = LineCodec(ascii_lines(("x", "y", "z"), ",", ".", MM))
    found = [each for _ in range(100) for each in codec.feed(b"9" * 1000)]
    assert [type(each) for each in found] == [BadLine]
    assert "no line end within 2048 bytes" in found[0].reason
    assert codec.feed(b"\n1,2,3\n") == [TargetReading((0.001, 0.002, 0.003), True)]


def test_a_refused_line_has_its_place_in_the_stream() -> None:
    codec = LineCodec(ascii_lines(("x", "y", "z"), ",", ".", MM))
    good, bad = codec.feed(b"1,2,3\r\nhello\r\n")
    assert isinstance(good, TargetReading)
    assert bad == BadLine(7, "1 columns, 3 are declared", b"hello")
