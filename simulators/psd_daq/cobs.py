"""Consistent Overhead Byte Stuffing, written out: a frame without zeros, so that a zero can end it.

Source: S. Cheshire, M. Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Trans. Networking 7(2), 1999, section III.
"""

LONGEST_RUN = 254  # data bytes behind one code byte; code 0xFF stands for such a run without a zero after it

CODES = [bytes((length + 1,)) for length in range(LONGEST_RUN)]  # by the length of the run that follows


class StuffingError(ValueError):
    """Bytes that no encoder makes: a code byte points over the end."""


def stuff(content: bytes) -> bytes:
    """Encoded `content`, without the delimiter."""
    segments = content.split(b"\0")
    if max(map(len, segments)) < LONGEST_RUN:  # nearly every frame of this box
        return b"".join([part for segment in segments for part in (CODES[len(segment)], segment)])
    out = bytearray()
    for number, segment in enumerate(segments):
        last = number == len(segments) - 1
        while len(segment) >= LONGEST_RUN:
            out.append(LONGEST_RUN + 1)
            out += segment[:LONGEST_RUN]
            segment = segment[LONGEST_RUN:]
            if last and not segment:
                return bytes(out)  # the run ended with the content: no zero is implied
        out.append(len(segment) + 1)
        out += segment
    return bytes(out)


def unstuff(encoded: bytes) -> bytes:
    """Content of `encoded` (without the delimiter). StuffingError when it cannot be the work of an encoder."""
    out = bytearray()
    at = 0
    while at < len(encoded):
        code = encoded[at]
        end = at + code
        if code == 0 or end > len(encoded):
            raise StuffingError(f"code byte 0x{code:02X} at {at} of {len(encoded)} bytes")
        out += encoded[at + 1 : end]
        at = end
        if code <= LONGEST_RUN and at < len(encoded):
            out.append(0)
    return bytes(out)
