"""The seal: truth under a one-time key that only the revealing process holds, and the hash that is published first.

The key never leaves the memory of the process that reveals, so that no other process can read the truth, whatever
folder it finds. Stream cipher: truth XOR SHAKE-256(key), FIPS 202, section 6.3; each key is used once.

The layout of a proof keeps recordings and answers on one side, seals on the other.
"""

import hashlib
import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RECORDED = "recording.mcap"


@dataclass(frozen=True)
class Layout:
    """Folders of a proof under `out`."""

    out: Path

    def recording(self, name: str) -> Path:
        """What a site would hand over: a session folder, or the file that was recorded."""
        folder = self.out / "recordings" / name
        return folder / RECORDED if (folder / RECORDED).is_file() else folder

    def simulation(self, name: str) -> Path:
        """A simulation of the same session, where there is one."""
        return self.out / "simulations" / name

    def recorded(self, name: str) -> Path:
        """The file of a session that is recorded."""
        return self.out / "recordings" / name / RECORDED

    def asked(self, name: str) -> Path:
        """Poses that nobody measured: where will the tool be?"""
        return self.out / "asked" / f"{name}.csv"

    @property
    def answers(self) -> Path:
        """Where the diagnosing process is at work."""
        return self.out / "answers"

    def answer(self, name: str) -> Path:
        """What the diagnosing process writes."""
        return self.answers / name

    def replayed(self, name: str) -> Path:
        """What `reconcile` writes, where it is asked."""
        return self.answer(name) / "replayed"

    def seal(self, name: str) -> Path:
        """The truth, unreadable."""
        return self.out / "sealed" / f"{name}.bin"

    def revealed(self, name: str) -> Path:
        """The truth, after every case has been diagnosed."""
        return self.out / "revealed" / f"{name}.json"

    @property
    def hashes(self) -> Path:
        """Published before anything is diagnosed."""
        return self.out / "hashes.txt"

    @property
    def slices(self) -> Path:
        """What is finished, slice by slice."""
        return self.out / "slices.json"

    def clear(self, name: str) -> None:
        """Nothing of a case is left."""
        for folder in (self.recorded(name).parent, self.simulation(name), self.answer(name)):
            shutil.rmtree(folder, ignore_errors=True)

    @property
    def proof(self) -> Path:
        return self.out / "proof.json"

    @property
    def page(self) -> Path:
        return self.out / "proof.html"


KEY_BYTES = 32


class BrokenSealError(ValueError):
    """What lies in the folder is not what was published."""


def new_key() -> bytes:
    """Random, for one case."""
    return secrets.token_bytes(KEY_BYTES)


def seal_truth(truth: bytes, key: bytes) -> bytes:
    """The truth as nobody can read it without the key; the same call opens it."""
    stream = hashlib.shake_256(key).digest(len(truth))
    return (np.frombuffer(truth, dtype=np.uint8) ^ np.frombuffer(stream, dtype=np.uint8)).tobytes()


def fingerprint(truth: bytes) -> str:
    """SHA-256, as it is published."""
    return hashlib.sha256(truth).hexdigest()


def open_seal(content: bytes, key: bytes, published: str) -> bytes:
    """The truth. BrokenSealError where its hash is another than the published one."""
    truth = seal_truth(content, key)
    if fingerprint(truth) != published:
        raise BrokenSealError(f"the seal holds SHA-256 {fingerprint(truth)}, published was {published}; conceal again")
    return truth
