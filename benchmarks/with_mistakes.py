"""Blunders as people make them, put into a session at a random row and joint; what is told must name them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples

Floats = NDArray[np.float64]

XYZ = ("x_m", "y_m", "z_m")
READINGS = (*XYZ, "wire_m", "psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
MILLIMETRE_COLUMNS = (*XYZ, "wire_m")


@dataclass(frozen=True)
class Made:
    """A session with a blunder; `names` must all stand in what is told, `rows` (from 0) be among those named."""

    samples: Samples
    names: tuple[str, ...]
    rows: tuple[int, ...] = ()  # empty: the whole file
    parts: tuple[Samples, ...] = ()  # of two mistakes at once: a session with each of `names` alone


@dataclass(frozen=True)
class Mistake:
    """One way to spoil a file; `needs` says which columns it speaks of."""

    name: str
    make: Callable[[Samples, Generator], Made]
    needs: Callable[[Samples], bool] = lambda _samples: True


def typed_angle(samples: Samples, rng: Generator) -> Made:
    """The first digit after the point of one angle is another one."""
    row, joint = int(rng.integers(len(samples))), int(rng.integers(samples.n_joints)) + 1
    name = f"q{joint}_rad"
    digits = int(rng.integers(1, 6)) * rng.choice([-0.1, 0.1])
    return Made(_cell(samples, name, row, samples.column(name)[row] + digits), (name,), (row,))


def typed_reading(samples: Samples, rng: Generator) -> Made:
    """A digit of one reading is another one: centimetres of a length, tenths of millimetres of a spot."""
    name = str(rng.choice([n for n in READINGS if n in samples]))
    row = int(rng.choice(np.flatnonzero(np.isfinite(samples.column(name)))))
    place = 1e-4 if name.startswith("psd") else 1e-2
    digits = int(rng.integers(2, 10)) * place * rng.choice([-1.0, 1.0])
    return Made(_cell(samples, name, row, samples.column(name)[row] + digits), (name,), (row,))


def bad_shot(samples: Samples, rng: Generator) -> Made:
    """A position somewhere else by centimetres."""
    row = int(rng.choice(np.flatnonzero(np.isfinite(samples.column("x_m")))))
    off = rng.normal(0.0, 0.02, 3)
    columns = {n: _with(samples.column(n), row, samples.column(n)[row] + d) for n, d in zip(XYZ, off, strict=True)}
    return Made(changed(samples, columns), ("x_m",), (row,))


def copied_row(samples: Samples, rng: Generator) -> Made:
    """A row stands again at the end."""
    row = int(rng.integers(len(samples) // 2)) if "bar" not in samples else 0
    columns = {n: np.append(v, v[row]) for n, v in samples.columns.items()}
    columns["t_s"] = np.append(samples.column("t_s"), samples.column("t_s")[row])
    return Made(Samples(columns, samples.n_joints), ("a copy of",), (len(samples),))


def other_session(samples: Samples, rng: Generator) -> Made:
    """A fifth of the rows were taken with the tracker elsewhere."""
    n = len(samples)
    first = int(rng.integers(n - n // 5))
    rows = slice(first, first + n // 5)
    xyz = np.stack([samples.column(c) for c in XYZ], axis=1)
    turn = Rotation.from_rotvec(rng.normal(0.0, 0.3, 3))
    xyz[rows] = turn.apply(xyz[rows]) + rng.normal(0.0, 0.3, 3)
    named = tuple(range(first, first + n // 5))
    return Made(changed(samples, dict(zip(XYZ, xyz.T, strict=True))), ("another device frame",), named)


def degrees(samples: Samples, rng: Generator) -> Made:
    """All joints in degrees."""
    del rng  # there is one way only
    return Made(changed(samples, {n: np.degrees(samples.column(n)) for n in _joints(samples)}), ("degrees",))


def turned_sense(samples: Samples, rng: Generator) -> Made:
    """One joint counted the other way round."""
    name = str(rng.choice(_joints(samples)))
    return Made(changed(samples, {name: -samples.column(name)}), (f"column {name}",))


def quarter_turn(samples: Samples, rng: Generator) -> Made:
    """One zero a quarter or half a turn off."""
    name, turns = str(rng.choice(_joints(samples))), float(rng.choice([-0.5, 0.5, 1.0]))
    return Made(changed(samples, {name: samples.column(name) + np.pi * turns}), (f"column {name}",))


def coupled_joint(samples: Samples, rng: Generator) -> Made:
    """One joint counted from the link before its neighbour."""
    joint, sign = int(rng.integers(2, samples.n_joints + 1)), float(rng.choice([-1.0, 1.0]))
    name = f"q{joint}_rad"
    mixed = samples.column(name) + sign * samples.column(f"q{joint - 1}_rad")
    return Made(changed(samples, {name: mixed}), (f"column {name}",))


def mirrored(samples: Samples, rng: Generator) -> Made:
    """One axis of the device the other way round."""
    name = str(rng.choice(XYZ))
    return Made(changed(samples, {name: -samples.column(name)}), ("determinant -1",))


def millimetres(samples: Samples, rng: Generator) -> Made:
    """Lengths of an instrument in millimetres."""
    del rng  # there is one way only
    names = [n for n in MILLIMETRE_COLUMNS if n in samples]
    return Made(changed(samples, {n: 1e3 * samples.column(n) for n in names}), ("millimetres",))


def degrees_and_sense(samples: Samples, rng: Generator) -> Made:
    """Two mistakes at once, of the angles."""
    first = turned_sense(samples, rng)
    parts = degrees(samples, rng).samples, first.samples
    return Made(degrees(first.samples, rng).samples, ("degrees", *first.names), (), parts)


def mirror_and_zero(samples: Samples, rng: Generator) -> Made:
    """Two mistakes at once, of angles and device."""
    first = quarter_turn(samples, rng)
    parts = mirrored(samples, rng).samples, first.samples
    return Made(mirrored(first.samples, rng).samples, ("determinant -1", *first.names), (), parts)


def two_senses(samples: Samples, rng: Generator) -> Made:
    """Two joints counted the other way round."""
    one, other = rng.choice(_joints(samples), 2, replace=False).tolist()
    columns = {name: -samples.column(name) for name in (one, other)}
    parts = tuple(changed(samples, {name: column}) for name, column in columns.items())
    return Made(changed(samples, columns), (f"column {one}", f"column {other}"), (), parts)


def changed(samples: Samples, columns: dict[str, Floats]) -> Samples:
    """A copy with other columns."""
    return Samples({**samples.columns, **columns}, samples.n_joints)


def _cell(samples: Samples, name: str, row: int, value: float) -> Samples:
    return changed(samples, {name: _with(samples.column(name), row, value)})


def _with(values: Floats, row: int, value: float) -> Floats:
    out = values.copy()
    out[row] = value
    return out


def _joints(samples: Samples) -> list[str]:
    return [f"q{i}_rad" for i in range(1, samples.n_joints + 1)]


def _has(*names: str) -> Callable[[Samples], bool]:
    return lambda samples: any(name in samples for name in names)


# One line for each mistake; whole files first.
WHOLE_FILE = (
    Mistake("degrees", degrees),
    Mistake("sense of a joint", turned_sense),
    Mistake("zero off by quarters", quarter_turn),
    Mistake("coupled joints", coupled_joint),
    Mistake("mirrored axis", mirrored, _has("x_m")),
    Mistake("millimetres", millimetres, _has("x_m", "wire_m")),
    Mistake("degrees + sense", degrees_and_sense),
    Mistake("mirror + zero", mirror_and_zero, _has("x_m")),
    Mistake("two senses", two_senses),
)
ROWS = (
    Mistake("typed angle", typed_angle),
    Mistake("typed reading", typed_reading, _has(*READINGS)),
    Mistake("bad shot", bad_shot, _has("x_m")),
    Mistake("copied row", copied_row),
    Mistake("other session", other_session, _has("x_m")),
)
