"""Instrument: a ball or tip that touches planes of unknown place, from whatever side and in whatever posture.

Observed at a pose: signed distance of the tip from its plane (m), which is zero. The radius of a ball is part of where
its plane is: the plane found is that of the ball's centre. Planes hold no scale: an arm half as large touches planes
half as far away. A known distance of two parallel planes (known_planes.py) is one source of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.samples import PLANE
from calibrate.errors import DataError
from calibrate.model.chain import About, SensorChain, Usage
from calibrate.model.parameters import Parameter
from calibrate.model.placement import PLAUSIBLE_M, SharedPoints, Target, point_by_twist
from calibrate.model.problem import Block, Measured
from calibrate.model.rigid import transform
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import Columns, Found, Frame, NoiseSource, SensorKind, Trait
from calibrate.model.sensors.known_planes import known_planes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DISTANCE = "plane_distance_m"  # no session holds it: the contact itself is the reading
PLANES = "plane"  # parameters are plane<k>.roll, .pitch, .z
NOISE = NoiseSource("plane", "m", "plane_m")
PLANE_ASSUMED_M = 1e-4  # start value where the rig's [noise] states nothing: flatness of a table; the data correct it
PLAUSIBLE_RAD = 0.1  # about the best plane of the nominal tips
FEWEST = 4  # any three touches are of one plane
NARROW = 0.02  # of the longest extent of the touches: narrower, the plane's turn about that line is open


@dataclass(frozen=True)
class TouchedPlanes(SharedPoints):
    """Of each plane a frame whose x, y lie in it. Parameters: roll, pitch (rad, about x, y) and z, its shift (m)."""

    axes: Mapping[int, Floats]  # plane -> (3, 3) its axes as columns, in the base

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        used = set(self.of_pose.tolist())
        each = (("roll", "rad", PLAUSIBLE_RAD), ("pitch", "rad", PLAUSIBLE_RAD), ("z", "m", self.plausible_m))
        return tuple(
            Parameter(f"{self.kind}{k}.{name}", unit, plausible, free=k in used)
            for k in self.numbers
            for name, unit, plausible in each
        )

    def about(self) -> About:
        return {f"{self.kind}{k}": frame_about(at, self.axes[k]) for k, at in self.start_m.items()}

    def placed(self, about: About) -> Self:
        frames = {k: about.get(f"{self.kind}{k}", frame_about(at, self.axes[k])) for k, at in self.start_m.items()}
        axes = {k: Rotation.from_rotvec(frame[3:]).as_matrix() for k, frame in frames.items()}
        return replace(self, start_m={k: np.array(frame[:3]) for k, frame in frames.items()}, axes=axes)

    def at_poses(self, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """Of each pose's plane: its start (pose, 3), axes (pose, 3, 3) and own values (pose, 3), for phi (3 plane,)."""
        starts = np.stack([self.start_m[k] for k in self.numbers])
        axes = np.stack([self.axes[k] for k in self.numbers])
        return starts[self._index], axes[self._index], phi.reshape(-1, 3)[self._index]


def frame_about(origin_m: Floats, axes: Floats) -> tuple[float, ...]:
    """Origin and rotation vector of a frame, as `about` holds it."""
    return (*origin_m.tolist(), *Rotation.from_matrix(axes).as_rotvec().tolist())


def tilted(axes: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Unit normals (..., 3) of planes with axes (..., 3, 3), for roll, pitch, z (..., 3); and (..., 3, 2) their slope.

    Roll and pitch are tangents of the turn: the normal is that of z + pitch x - roll y.
    """
    across = np.stack([-axes[..., 1], axes[..., 0]], axis=-1)
    raw = axes[..., 2] + (across @ values[..., :2, None])[..., 0]
    size = np.linalg.norm(raw, axis=-1, keepdims=True)
    normal = raw / size
    by = (across - normal[..., :, None] * (normal[..., None, :] @ across)) / size[..., None]
    return normal, by


@dataclass(frozen=True)
class Plane(Usage):
    """Pose j touches plane `planes.of_pose[j]`. Parameters: target 3, then those of the planes."""

    target: Target
    planes: TouchedPlanes

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.planes.parameters

    def about(self) -> About:
        return {**self.target.about(), **self.planes.about()}

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about), planes=self.planes.placed(about))

    def spot(self) -> Ints:
        return 1 + self.planes.of_pose

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, planes=self.planes.select(rows))

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        start, axes, values = self.planes.at_poses(phi[3:])
        away = self.target.in_base(phi[:3], T_base_flange) - start
        return np.sum(tilted(axes, values)[0] * away, axis=1, keepdims=True) - values[:, 2:]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        _, axes, values = self.planes.at_poses(phi[3:])
        tips = self.target.in_base(phi[:3], T_base_flange)
        return tilted(axes, values)[0][:, None, :] @ point_by_twist(tips)

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        start, axes, values = self.planes.at_poses(phi[3:])
        away = self.target.in_base(phi[:3], T_base_flange) - start
        normal, by = tilted(axes, values)
        own = np.concatenate([away[:, None, :] @ by, np.full((len(away), 1, 1), -1.0)], axis=2)
        return np.concatenate([normal[:, None, :] @ T_base_flange[:, :3, :3], self.planes.by_shift(own)], axis=-1)


def best_planes(tips_m: Floats, plane: Ints) -> TouchedPlanes:
    """The planes nearest to the nominal tips (pose, 3), by least squares: the direction of least extent is the normal.

    DataError for a plane of fewer than four touches, or with all of them on a line.
    """
    starts: dict[int, Floats] = {}
    axes: dict[int, Floats] = {}
    for k in sorted(set(plane.tolist())):
        at = tips_m[plane == k]
        if len(at) < FEWEST:
            raise DataError(
                f"plane {k}: {len(at)} row(s); any three touches are of one plane; touch it {FEWEST} times or more, or "
                "remove the rows"
            )
        starts[k] = at.mean(axis=0)
        _, extent, directions = np.linalg.svd(at - starts[k], full_matrices=False)
        if extent[1] < NARROW * extent[0]:
            raise DataError(f"plane {k}: all touches are on one line; touch it beside this line, too")
        x, _, z = directions
        axes[k] = np.stack([x, np.cross(z, x), z], axis=1)
    return TouchedPlanes(PLANES, starts, plane, PLAUSIBLE_M, axes)


def _planes(table: SampleTable) -> tuple[NDArray[np.intp], TouchedPlanes]:
    rows = table.filled(PLANE)
    return rows, best_planes(table.tips_m[rows], table.samples.integers(PLANE, 0)[rows])


def _build(table: SampleTable) -> Measured | None:
    if len(table.filled(PLANE)) == 0:
        return None
    rows, planes = _planes(table)
    own = {NOISE.name: np.full((len(rows), 1), table.rig.noise.plane_m or PLANE_ASSUMED_M)}
    chain = SensorChain(table.arm, Plane(table.target, planes))
    return table.measured(KIND.name, chain, rows, np.zeros((len(rows), 1)), own, condition=True)


def _lengths(table: SampleTable) -> tuple[Block, ...]:
    rows, planes = _planes(table)
    tips_m = table.tips_m[rows]
    extent_m = {
        k: float(np.sqrt(np.mean(np.sum((tips_m[planes.of_pose == k] - at) ** 2, axis=1))))
        for k, at in planes.start_m.items()
    }
    return known_planes(table.rig, planes.parameters, planes.start_m, planes.axes, extent_m)


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    """Signed distance of the tip from its plane; NaN without a plane that the model knows."""
    tips_m, plane, out = found.tip_at(T_base_flange), samples.integers(PLANE, 0), np.full(len(samples), np.nan)
    for k in sorted(set(plane.tolist())):
        about = found.about.get(f"{PLANES}{k}")
        if about is not None:
            values = np.array([found.values.get(f"{PLANES}{k}.{name}", 0.0) for name in ("roll", "pitch", "z")])
            at = transform(about[:3], about[3:])
            normal, _ = tilted(at[:3, :3], values)
            out[plane == k] = (tips_m[plane == k] - at[:3, 3]) @ normal - values[2]
    return {DISTANCE: out}


def _observed(found: Found, samples: Samples) -> Columns | None:
    """A contact is at no distance."""
    if PLANE not in samples:
        return None
    return {DISTANCE: np.where(np.isfinite(samples.column(PLANE)), 0.0, np.nan)}


KIND = SensorKind(
    name="plane",
    columns=(PLANE,),
    title="Touched planes",
    noun="touches of planes",
    noise=(NOISE,),
    traits=frozenset({Trait.TARGET, Trait.TOUCHED, Trait.SCALELESS}),
    frames=(Frame(PLANES, "plane", "where the planes are", "where plane", 6),),
    reads=(DISTANCE,),
    asks=(PLANE,),
    build=_build,
    lengths=_lengths,
    predict=_predict,
    observed=_observed,
    place=lambda samples: samples.integers(PLANE, 0),
)
