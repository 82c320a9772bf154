"""Bytes on a damaged line: good pieces, then one to four changes, of which many hit a length."""

from collections.abc import Sequence

import numpy as np


def mutated(rng: np.random.Generator, good: Sequence[bytes], pieces: int | None = None) -> bytes:
    """Good pieces with bits turned, bytes exchanged, lost or put in, a length torn up, the end cut off.

    One to three pieces follow one another, if `pieces` does not give their number.
    """
    many = rng.integers(1, 4) if pieces is None else pieces
    data = bytearray(b"".join(good[rng.integers(len(good))] for _ in range(many)))
    for _ in range(rng.integers(1, 5)):
        at, many = int(rng.integers(0, len(data) + 1)), int(rng.integers(1, 9))
        match int(rng.integers(6)):
            case 0 if at < len(data):
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                data[at : at + many] = rng.bytes(many)
            case 2:
                del data[at : at + many]
            case 3:
                data[at:at] = rng.bytes(many)
            case 4:
                data[at : at + 2] = b"\xff\xff"
            case _:
                del data[at:]
    return bytes(data)
