"""Instrument: a second encoder at each joint, read against the controller's: enc - q (rad), one channel a joint.

What lies between the two encoders shows here without a lever and without the arm: the twist of a soft drive, play, the
disc of either encoder, a slip. Neither the zero of a second encoder nor the sense in which it counts is anybody's
statement: both are found, the zero as a free parameter of each joint. The flange moves nothing here; effects at a
joint's angle act on this instrument directly (calibrate/model/effects/ports.py, Perturbation.between_rad).

Mean and spread of angles that wrap: Mardia, Jupp, Directional Statistics, 2000, section 2.2.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import per_joint
from calibrate.errors import DataError
from calibrate.model.chain import SensorChain, Usage
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    NoiseSource,
    Quantity,
    SensorKind,
    Trait,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

NAME = "encoder-difference"
SOURCE = "encoder"  # of noise
ASSUMED_RAD = 5e-6  # a count of 20 bits a turn is 6 µrad; the data correct it
FOLLOWS_RAD = 0.05  # what no drive and no disc does: the readings are then not of one joint, or not in joint angles
FEWEST = 10  # rows of a joint, for a zero and a scatter
LISTED = 5  # rows of a sentence
PLAUSIBLE_RAD = 1e-3  # by which a zero may lie off the middle of the differences


@dataclass(frozen=True)
class EncoderDifference(Usage):
    """Observed at a pose: reading of the second encoder, in the controller's sense, less the controller's, rad."""

    joints: tuple[int, ...]  # (channel,) from 1
    zero_rad: Floats  # (channel,) middle of the differences

    unit = "rad"

    def own_columns(self) -> tuple[str, ...]:
        return tuple(f"enc{joint}_rad" for joint in self.joints)

    def joints_compared(self) -> tuple[int, ...]:
        return self.joints

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        each = zip(self.joints, self.zero_rad.tolist(), strict=True)
        return tuple(Parameter(f"encoder{joint}.zero", "rad", PLAUSIBLE_RAD, start=zero) for joint, zero in each)

    @property
    def channels(self) -> Ints:
        """(channel,) columns of a table with one column a joint."""
        return np.array(self.joints, dtype=np.intp) - 1

    def select(self, rows: Ints) -> "EncoderDifference":
        return self

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return np.broadcast_to(phi, (len(T_base_flange), len(self.joints))).copy()

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return np.zeros((len(T_base_flange), len(self.joints), 6))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        k = len(self.joints)
        return np.broadcast_to(np.eye(k), (len(T_base_flange), k, k)).copy()


@dataclass(frozen=True, eq=False)
class Differences:
    """Second encoders against the controller's, all joints, used or not."""

    sense: Floats  # (joint,) 1, or -1: the encoder counts against the joint; 0: it does not follow, or is not there
    zero_rad: Floats  # (joint,) middle of the differences
    difference_rad: Floats  # (row, joint) without jumps of a turn; NaN where a reading is missing

    @property
    def used(self) -> tuple[int, ...]:
        """Joints, from 1."""
        return tuple(int(j) + 1 for j in np.flatnonzero(self.sense))


def differences(samples: Samples) -> Differences | None:
    """None where no column of a second encoder holds a number."""
    n, q_rad = samples.n_joints, samples.joints()
    sense, zero, out = np.zeros(n), np.zeros(n), np.full(q_rad.shape, np.nan)
    for joint, name in enumerate(per_joint("enc", "_rad", n)):
        if name not in samples or np.isfinite(samples.column(name) + q_rad[:, joint]).sum() < FEWEST:
            continue
        for sign in (1.0, -1.0):
            middle, unwrapped = _about_middle(sign * samples.column(name) - q_rad[:, joint])
            if np.nanmedian(np.abs(unwrapped - middle)) < FOLLOWS_RAD:
                sense[joint], zero[joint], out[:, joint] = sign, middle, unwrapped
                break
    return Differences(sense, zero, out) if sense.any() else None


def not_following(samples: Samples) -> tuple[str, ...]:
    """Columns of second encoders that hold numbers and do not follow their joint, in either sense."""
    found, q_rad = differences(samples), samples.joints()
    out: list[str] = []
    for joint, name in enumerate(per_joint("enc", "_rad", samples.n_joints)):
        filled = name in samples and np.isfinite(samples.column(name) + q_rad[:, joint]).sum() >= FEWEST
        if filled and (found is None or found.sense[joint] == 0.0):
            out.append(name)
    return tuple(out)


def _unused(samples: Samples) -> tuple[str, ...]:
    """Columns that are not used at all, then rows that are not, joint by joint."""
    names = per_joint("enc", "_rad", samples.n_joints)
    return (*_rows_unused(samples), *_columns_unused(samples, names))


def _rows_unused(samples: Samples) -> Iterator[str]:
    """A sentence for each encoder because of which rows of all second encoders are left out."""
    if (found := differences(samples)) is None:
        return
    away = np.abs(found.difference_rad - found.zero_rad)[:, [joint - 1 for joint in found.used]]
    blank = np.isnan(away) & np.isfinite(away).any(axis=1, keepdims=True)  # where none answered, nothing is left out
    off = np.nan_to_num(away) >= FOLLOWS_RAD
    for k, joint in enumerate(found.used):
        for rows, why in (
            (np.flatnonzero(off[:, k]), f"is more than {FOLLOWS_RAD:g} rad off its usual difference from the joint"),
            (np.flatnonzero(blank[:, k]), "holds no number"),
        ):
            if len(rows):
                listed = ", ".join(str(row + 1) for row in rows[:LISTED].tolist()) + " ..." * (len(rows) > LISTED)
                yield (
                    f"enc{joint}_rad {why} in {len(rows)} of {len(away)} rows ({listed}): no second encoder is used "
                    "in these rows; correct the cells, or remove the column"
                )


def _columns_unused(samples: Samples, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(
        f"{name} does not follow joint {names.index(name) + 1} and is not used: its readings differ from "
        f"q{names.index(name) + 1}_rad by more than {FOLLOWS_RAD:g} rad; put it in the column of the joint that it "
        "sits on, in rad, or remove it"
        for name in not_following(samples)
    )


def encoder_angles(samples: Samples) -> Samples:
    """The samples with the second encoders' angles in the place of the controller's: sense and zero are its own.

    DataError where an encoder is missing, or does not follow its joint.
    """
    found = differences(samples)
    lacking = [j + 1 for j in range(samples.n_joints) if found is None or found.sense[j] == 0.0]
    if found is None or lacking:
        raise DataError(
            f"samples: angles = 'encoders' needs columns enc1_rad ... of encoders that follow their joints, which "
            f"joint {lacking[0]} has not; fit angles = 'controller' instead"
        )
    angles = samples.joints() + found.difference_rad - found.zero_rad
    columns = {name: angles[:, j] for j, name in enumerate(per_joint("q", "_rad", samples.n_joints))}
    return replace(samples, columns={**samples.columns, **columns})


def _build(table: SampleTable) -> Measured | None:
    """The instrument of a session; none without second encoders.

    Rows in which one of the encoders did not answer, or is off by more than any drive and disc, are left out.
    """
    found = differences(table.samples)
    if found is None:
        return None
    sensor = EncoderDifference(found.used, found.zero_rad[[j - 1 for j in found.used]])
    observed = found.difference_rad[:, sensor.channels]
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero((np.abs(observed - sensor.zero_rad) < FOLLOWS_RAD).all(axis=1))
    if len(rows) < FEWEST:
        return None
    sigma = np.full((len(rows), len(sensor.joints)), ASSUMED_RAD)
    return table.measured(NAME, SensorChain(table.arm, sensor), rows, observed[rows], {SOURCE: sigma})


def _about_middle(difference_rad: Floats) -> tuple[float, Floats]:
    """Middle in (-pi, pi], and the differences without jumps of a turn."""
    known = difference_rad[np.isfinite(difference_rad)]
    mean = float(np.angle(np.mean(np.exp(1j * known))))
    unwrapped = mean + _wrapped(difference_rad - mean)
    middle = float(np.nanmedian(unwrapped))
    return middle, middle + _wrapped(difference_rad - middle)


def _wrapped(angle_rad: Floats) -> Floats:
    return (angle_rad + np.pi) % (2.0 * np.pi) - np.pi


KIND = SensorKind(
    name=NAME,
    columns=(),  # one for each joint: EncoderDifference.own_columns
    title="Second encoders",
    noun="second encoders",
    quantities=(Quantity("", "rad"),),
    noise=(NoiseSource(SOURCE, "rad"),),
    traits=frozenset({Trait.BETWEEN_ENCODERS}),
    only_asked=True,
    build=_build,
    unused=_unused,
)
