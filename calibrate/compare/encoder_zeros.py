"""Zeros of second encoders in two recordings: arbitrary, but the same as long as nothing slipped or was set again."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibrate.compare.comparison_file import Level, Mismatch
from calibrate.diagnose.streams import StreamDevice, StreamReport, examine_encoders
from calibrate.model.effects.term import Size
from calibrate.quantities import angle_with_sigma

ZERO = "encoder-zero-moved"
SIGMAS = 5.0  # of a change that is reported
DISCS_RAD = 1.5e-3  # five sigmas of usual discs off their centres: over other angles they show another level


@dataclass(frozen=True)
class ZeroChange:
    """Of one encoder (from 1): first recording less second; found from `limit_rad` on."""

    where: str
    noun: str
    change: Size
    limit_rad: float

    @property
    def found(self) -> bool:
        return abs(self.change.value) > self.limit_rad


def joint_zeros(measured: StreamReport | None, simulated: StreamReport | None) -> tuple[ZeroChange, ...]:
    """Of second encoders of an arm's joints, each against its own joint; of joints that both recordings determine."""
    one, two = (_levels(report) for report in (measured, simulated))
    nouns = {joint: f"the second encoder of joint {joint}" for joint in one}
    return tuple(_change(f"joint{j}.angle", nouns[j], one[j], two[j]) for j in sorted(one.keys() & two.keys()))


def pair_zeros(measured: StreamDevice, simulated: StreamDevice) -> tuple[ZeroChange, ...]:
    """Of encoders on one shaft, each against the first one."""
    one, two = (
        {pair.number: (pair.level_rad, 0.0) for pair in examine_encoders(device)[1] if pair.level_rad is not None}
        for device in (measured, simulated)
    )
    return tuple(
        _change(f"encoder{k}.angle", f"encoder {k} against encoder 1", one[k], two[k])
        for k in sorted(one.keys() & two.keys())
    )


def _levels(report: StreamReport | None) -> Mapping[int, tuple[Size, float]]:
    """Joint -> reading less joint over the whole recording, whatever zero its rig file states, and the smallest change
    that counts.
    """
    offsets = () if report is None else report.offsets.get("encoders", ())
    levels = {o.joint: (o.stretches[0].offset, o) for o in offsets if o.stretches and o.steady}
    return {
        joint: (Size(at.value + one.zero_rad, at.sigma), max(one.limit_rad or 0.0, DISCS_RAD))
        for joint, (at, one) in levels.items()
    }


def _change(where: str, noun: str, one: tuple[Size, float], two: tuple[Size, float]) -> ZeroChange:
    by = (one[0].value - two[0].value + np.pi) % (2.0 * np.pi) - np.pi
    sigma = float(np.hypot(one[0].sigma, two[0].sigma))
    return ZeroChange(where, noun, Size(float(by), sigma), max(SIGMAS * sigma, one[1], two[1]))


def zero_mismatches_of(changes: Sequence[ZeroChange]) -> Iterator[Mismatch]:
    """Those that are beyond their limit."""
    for one in changes:
        if one.found:
            by = angle_with_sigma(one.change.value, one.change.sigma)
            says = f"Zero of {one.noun}: {by} more in the measured recording than in the other one"
            yield Mismatch(Level.ENCODER_ZEROS, one.where, ZERO, {"zero_rad": one.change}, says)
