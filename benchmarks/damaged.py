"""A recording cut at random bytes, and with random bits flipped: what is read is right, or it is refused."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from acquisition.recording import Channel, Event, Recording, RecordingError, RecordingWriter, read
from acquisition.recording.rig import rig_text

CUTS = FLIPS = 2000
SEED = 3
BATCHES, EACH = 60, 20


@dataclass
class Tally:
    """How readings of damaged copies ended."""

    whole: int = 0  # nothing missing, and nothing was said
    reported: int = 0  # damage told, the rest read
    refused: int = 0  # one clear error
    wrong: int = 0  # a value that was never recorded
    silent: int = 0  # something missing, and nothing said
    other: int = 0  # an exception that is not ours
    kept: float = 0.0  # mean share of the samples, of copies that were read


def lines(rig: Path, cuts: int = CUTS, flips: int = FLIPS) -> Iterator[str]:
    rng = np.random.default_rng(SEED)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.mcap"
        _record(rig, path)
        data, intact = path.read_bytes(), read(path)
        hurt = Path(folder) / "hurt.mcap"
        places = rng.integers(0, len(data), cuts).tolist()
        yield f"{cuts} cuts of {len(data)} bytes: {_line(_tally((data[:at] for at in places), hurt, intact))}"
        bits = zip(rng.integers(0, len(data), flips).tolist(), rng.integers(0, 8, flips).tolist(), strict=True)
        yield f"{flips} flipped bits: {_line(_tally((_flipped(data, at, bit) for at, bit in bits), hurt, intact))}"
        torn = data[: int(0.8 * len(data))]
        bits = zip(rng.integers(0, len(torn), flips).tolist(), rng.integers(0, 8, flips).tolist(), strict=True)
        yield f"{flips} flipped bits of a torn file: {_line(_tally((_flipped(torn, *b) for b in bits), hurt, intact))}"


def _record(rig: Path, path: Path) -> None:
    rng = np.random.default_rng(0)

    class Standing:
        def now_s(self) -> float:
            return 1000.0

    notes = {"seed": "31415926"}
    with RecordingWriter(path, rig_text=rig_text(rig), software="benchmark", clock=Standing(), notes=notes) as writer:
        stream = writer.stream("psd", (Channel("spot_m", "m", (4,)), Channel("flags", "")))
        joints = writer.rig.n_joints
        for batch in range(BATCHES):
            number = np.arange(EACH * batch, EACH * (batch + 1))
            host_s = 1000.0 + number * 1e-3
            stream.append(host_s, host_s, number, {"spot_m": rng.normal(size=(EACH, 4)), "flags": number % 7})
            row = {f"q{joint + 1}_rad": float(rng.normal()) for joint in range(joints)}
            writer.sample({"t_s": float(batch), **row})
            writer.event(Event(1000.0 + batch, "tick", {"batch": batch}))
            writer.flush()


def _flipped(data: bytes, at: int, bit: int) -> bytes:
    hurt = bytearray(data)
    hurt[at] ^= 1 << bit
    return bytes(hurt)


def _tally(copies: Iterator[bytes], hurt: Path, intact: Recording) -> Tally:
    tally, kept = Tally(), list[float]()
    for copy in copies:
        hurt.write_bytes(copy)
        try:
            recording = read(hurt)
        except RecordingError:
            tally.refused += 1
            continue
        except Exception:  # that is what is counted
            tally.other += 1
            continue
        kept.append(_share(recording, intact))
        if not _right(recording, intact):
            tally.wrong += 1
        elif recording.damage or not recording.complete:
            tally.reported += 1
        elif kept[-1] == 1.0:
            tally.whole += 1
        else:
            tally.silent += 1
    tally.kept = float(np.mean(kept)) if kept else 0.0
    return tally


def _share(recording: Recording, intact: Recording) -> float:
    stream = recording.streams.get("psd")
    return 0.0 if stream is None else stream.host_s.size / intact.streams["psd"].host_s.size


def _right(recording: Recording, intact: Recording) -> bool:
    """Whether everything that was read is, to the bit, what was recorded."""
    about = ("rig_text", "host", "host_s0", "started_utc")
    if any(getattr(recording, name) != getattr(intact, name) for name in about):
        return False
    if recording.notes not in ({}, intact.notes) or any(event not in intact.events for event in recording.events):
        return False
    rows = list(intact.samples.rows())
    if any(row not in rows for row in recording.samples.rows()):
        return False
    if set(recording.streams) - set(intact.streams):
        return False
    if (stream := recording.streams.get("psd")) is None:
        return True
    true = intact.streams["psd"]
    at = np.clip(stream.sequence, 0, true.sequence.size - 1)
    return stream.channels == true.channels and all(
        np.array_equal(mine, theirs[at])
        for mine, theirs in (
            (stream.sequence, true.sequence),
            (stream.host_s, true.host_s),
            (stream.device_s, true.device_s),
            *((stream.values[name], true.values[name]) for name in true.values),
        )
    )


def _line(tally: Tally) -> str:
    return (
        f"{tally.wrong} wrong values, {tally.silent} losses not told, {tally.other} other exceptions; {tally.reported} "
        f"read with the damage told, {tally.refused} refused in one sentence, {tally.whole} unharmed; "
        f"{100.0 * tally.kept:.0f} % of the samples kept in the mean"
    )
