"""The seal: unreadable without its key, and broken when touched."""

import pytest

from calibeam.prove.seal import BrokenSealError, fingerprint, new_key, open_seal, seal_truth

TRUTH = b'{"defects": [{"physics": "backlash", "port": "joint2.angle"}]}' * 20


def test_a_sealed_truth_is_opened_by_its_key() -> None:
    key = new_key()
    assert open_seal(seal_truth(TRUTH, key), key, fingerprint(TRUTH)) == TRUTH


def test_nothing_of_the_truth_can_be_read_without_the_key() -> None:
    content = seal_truth(TRUTH, new_key())
    assert not any(word in content for word in (b"defects", b"physics", b"backlash", b"joint2"))


def test_a_touched_seal_is_refused() -> None:
    key = new_key()
    content = bytearray(seal_truth(TRUTH, key))
    content[7] ^= 1
    with pytest.raises(BrokenSealError, match="published was"):
        open_seal(bytes(content), key, fingerprint(TRUTH))


def test_another_key_opens_nothing() -> None:
    with pytest.raises(BrokenSealError):
        open_seal(seal_truth(TRUTH, new_key()), new_key(), fingerprint(TRUTH))


def test_keys_are_used_once() -> None:
    assert new_key() != new_key()
