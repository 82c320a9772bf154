"""The seal: truth under a one-time key that only the revealing process holds, and the hash that is published first.

The key never leaves the memory of the process that reveals, so that no other process can read the truth, whatever
folder it finds. Stream cipher: truth XOR SHAKE-256(key), FIPS 202, section 6.3; each key is used once.
"""

import hashlib
import secrets

import numpy as np

KEY_BYTES = 32


class BrokenSealError(ValueError):
    """What lies in the folder is not what was published."""


def new_key() -> bytes:
    """Random, for one case."""
    return secrets.token_bytes(KEY_BYTES)


def sealed(truth: bytes, key: bytes) -> bytes:
    """The truth as nobody can read it without the key; the same call opens it."""
    stream = hashlib.shake_256(key).digest(len(truth))
    return (np.frombuffer(truth, dtype=np.uint8) ^ np.frombuffer(stream, dtype=np.uint8)).tobytes()


def fingerprint(truth: bytes) -> str:
    """SHA-256, as it is published."""
    return hashlib.sha256(truth).hexdigest()


def opened(content: bytes, key: bytes, published: str) -> bytes:
    """The truth. BrokenSealError where its hash is another than the published one."""
    truth = sealed(content, key)
    if fingerprint(truth) != published:
        raise BrokenSealError(f"the seal holds SHA-256 {fingerprint(truth)}, published was {published}; conceal anew")
    return truth
