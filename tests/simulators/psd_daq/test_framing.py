"""The emulator's own framing against published values and the independent `cobs` package."""

from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from simulators.psd_daq.frames import StuffingError, checksum, stuff, unstuff

content = st.one_of(
    st.binary(max_size=300),
    st.builds(
        lambda run, n, end: bytes((run,)) * n + end, st.integers(0, 255), st.integers(250, 520), st.binary(max_size=3)
    ),
)


def test_the_checksum_is_the_published_one():
    assert checksum(b"123456789") == 0x29B1  # catalogue of parametrised CRC algorithms, CRC-16/CCITT-FALSE


@given(content)
def test_both_stuffings_agree(data):
    stuffed = stuff(data)
    assert stuffed == cobs.encode(data)
    assert b"\0" not in stuffed
    assert unstuff(stuffed) == data


@given(st.binary(min_size=1, max_size=60))
def test_both_refuse_or_read_the_same_junk(junk):
    try:
        expected = cobs.decode(junk)
    except cobs.DecodeError:
        expected = None
    try:
        found = unstuff(junk)
    except StuffingError:
        found = None
    assert found == expected
