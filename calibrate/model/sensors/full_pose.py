"""Instrument: a 6-D tracker or camera that measures position and orientation of the target in its own frame.

The orientation is compared as the rotation vector of (expected times inverse of observed), in the device's axes: a
difference of two rotation vectors would break near half a turn. So `expect` needs what was observed, and the
observation to compare with is (x, y, z, 0, 0, 0).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION
from calibrate.model.alignment import best_rotation, nearest_rotation
from calibrate.model.chain import About, SensorChain, Usage
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import median, weights
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    filled,
    stacked,
    thinned,
)
from calibrate.model.parameters import Parameter
from calibrate.model.placement import Device, Target, point_by_twist
from calibrate.model.problem import Measured
from calibrate.model.rigid import cross_matrix, left_jacobian
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    NoiseSource,
    Quantity,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.position import (
    NOISE,
    device_of,
    position_sigma_m,
    predicted_positions,
)

Floats = NDArray[np.float64]

ORIENTATION_ASSUMED_RAD = 1e-4  # a 6-D target at a tracker is stated to 0.01 deg
TURN_PLAUSIBLE_RAD = 0.1  # how a target is screwed on, against the drawing
TURNS = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class FullPose(Usage):
    """Observed at a pose: x, y, z (m) and turn from the observed to the expected orientation (rad).

    Parameters: target 6 (point, then rotation vector of its own axes in the flange frame), device 6.
    """

    target: Target
    device: Device
    R_device_target: Floats  # (pose, 3, 3) as observed
    R_flange_target: Floats  # (3, 3) assumed
    turn_plausible_rad: float = TURN_PLAUSIBLE_RAD

    unit = "m, rad"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        turns = tuple(Parameter(f"{self.target.name}.{a}", "rad", self.turn_plausible_rad) for a in TURNS)
        return self.target.parameters + turns + self.device.parameters

    def about(self) -> About:
        turn = Rotation.from_matrix(self.R_flange_target).as_rotvec()
        return {self.target.name: (*self.target.point_m.tolist(), *turn.tolist()), **self.device.about()}

    def placed(self, about: About) -> Self:
        tool = about.get(self.target.name, ())
        R = Rotation.from_rotvec(tool[3:]).as_matrix() if len(tool) == 6 else self.R_flange_target
        return replace(self, target=self.target.placed(about), device=self.device.placed(about), R_flange_target=R)

    def facing(self, expected: Floats) -> Self:
        """A turn from another pose's orientation may pass half a turn."""
        turn = Rotation.from_rotvec(expected[:, 3:]).as_matrix()
        return replace(self, R_device_target=turn @ self.R_device_target)

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, R_device_target=self.R_device_target[rows])

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        T = self.device.T_base_device_at(phi[6:])
        position = (self.target.in_base(phi[:3], T_base_flange) - T[:3, 3]) @ T[:3, :3]
        return np.concatenate([position, self._turn(phi, T_base_flange)], axis=1)

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        out = np.zeros((len(T_base_flange), 6, 6))
        out[:, :3] = R_device_base @ point_by_twist(self.target.in_base(phi[:3], T_base_flange))
        out[:, 3:, 3:] = inverse_left_jacobian(self._turn(phi, T_base_flange)) @ R_device_base
        return out

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        R_device_flange = R_device_base @ T_base_flange[:, :3, :3]
        log = inverse_left_jacobian(self._turn(phi, T_base_flange))
        out = np.zeros((len(T_base_flange), 6, 12))
        out[:, :3, :3] = R_device_flange
        out[:, 3:, 3:6] = log @ R_device_flange @ self.R_flange_target @ left_jacobian(phi[3:6])
        out[:, :3, 6:] = self.device.seen_by_parameter(phi[6:], self.target.in_base(phi[:3], T_base_flange))
        # the device turning by w is the target turning by -w, both in the device's assumed axes
        own = R_device_base @ self.device.T_base_device[:3, :3] @ left_jacobian(phi[9:])
        out[:, 3:, 9:] = -log @ own
        return out

    def _turn(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, 3) rotation vector that leads from the observed to the expected orientation, device axes."""
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        R_flange_target = self.R_flange_target @ Rotation.from_rotvec(phi[3:6]).as_matrix()
        expected = R_device_base @ T_base_flange[:, :3, :3] @ R_flange_target
        return Rotation.from_matrix(expected @ np.swapaxes(self.R_device_target, 1, 2)).as_rotvec().reshape(-1, 3)


def inverse_left_jacobian(rotation_rad: Floats) -> Floats:
    """(pose, 3, 3) of rotation vectors (pose, 3): log(Exp(w) Exp(r)) = r + J^-1 w to first order.

    Source: Sola, Deray, Atchuthan, A micro Lie theory, arXiv 1812.01537, eq. (146).
    """
    angle = np.linalg.norm(rotation_rad, axis=1)
    small = angle < 1e-4  # series of the factor: 1/12 + angle^2/720; the next term is below 1e-20
    safe = np.where(small, 1.0, angle)
    factor = np.where(small, 1.0 / 12.0 + angle**2 / 720.0, 1.0 / safe**2 - 1.0 / (2.0 * safe * np.tan(safe / 2.0)))
    cross_r = cross_matrix(rotation_rad)
    return np.eye(3) - cross_r / 2.0 + factor[:, None, None] * (cross_r @ cross_r)


SAID_COLUMNS = "columns rx_rad, ry_rad, rz_rad"
FEWEST_POSES = 12  # two rotations have six unknowns
LEVER_M = 0.2  # an angle counts by what it moves at this distance: a hand's length
ROUNDS = 10  # compared are factors, not digits


@dataclass(frozen=True)
class OrientationWitness:
    """R_device_target = A R_base_flange X with unknown rotations A of the device and X of the target's mount."""

    q_rad: Floats  # (pose, joint)
    rotation_rad: Floats  # (pose, 3) rotation vectors as written
    columns: str = SAID_COLUMNS

    def strain(self, T_base_flange: Floats) -> Strain:
        """A and X as mean rotations in turn, from the start that the turns between poses give."""
        flange, seen = T_base_flange[..., :3, :3], Rotation.from_rotvec(self.rotation_rad).as_matrix()
        device = best_rotation(_steps(seen), _steps(flange))  # their axes differ by A
        weight, angle = np.ones(flange.shape[:-2]), np.zeros(flange.shape[:-2])
        for _ in range(ROUNDS):
            turned = device[..., None, :, :] @ flange
            mount = nearest_rotation(_products(turned, weight[..., None, None] * seen))
            carried = flange @ mount[..., None, :, :]
            device = nearest_rotation(_products(_transposed(weight[..., None, None] * seen), _transposed(carried)))
            apart = np.linalg.norm(device[..., None, :, :] @ carried - seen, axis=(-2, -1))
            angle = 2.0 * np.arcsin(np.minimum(apart / np.sqrt(8.0), 1.0))
            weight = weights(angle)
        typical = LEVER_M * median(angle)
        return Strain(typical, 0.0 * typical)

    def otherwise(self) -> Iterator[Otherwise]:
        """As `written_otherwise`."""
        for otherwise, _ in self.written_otherwise():
            yield otherwise

    def written_otherwise(self) -> Iterator[tuple[Otherwise, "OrientationWitness"]]:
        """Degrees, and the orientation of the device in the target instead of the other way round."""
        other = replace(self, rotation_rad=np.radians(self.rotation_rad))
        yield (
            Otherwise(
                GrossErrorKind.DEGREES,
                self.columns,
                "rotation vectors in degrees",
                "write radians (degrees times pi/180)",
                other,
            ),
            other,
        )
        other = replace(self, rotation_rad=-self.rotation_rad)
        yield (
            Otherwise(
                GrossErrorKind.INVERTED_ROTATION,
                self.columns,
                "rotation vectors of the device in the target's axes",
                "change the sign of all three columns: they lead from the device to the target",
                other,
            ),
            other,
        )


def _steps(R: Floats) -> Floats:
    """(..., pose - 1, 3) rotation vectors from each of these (..., pose, 3, 3) to the next."""
    steps = R[..., 1:, :, :] @ _transposed(R[..., :-1, :, :])
    return Rotation.from_matrix(steps.reshape(-1, 3, 3)).as_rotvec().reshape(steps.shape[:-1])


def _transposed(R: Floats) -> Floats:
    return np.swapaxes(R, -1, -2)


def _products(a: Floats, b: Floats) -> Floats:
    """(..., 3, 3) sum of a transposed times b over poses (..., pose, 3, 3): the rotation nearest to it is their mean.

    Source: Moakher, SIAM J. Matrix Anal. 24, 2002.
    """
    flat = (*a.shape[:-3], -1, 3)
    return _transposed(a.reshape(flat)) @ b.reshape(flat)


def mounted(T_base_flange: Floats, R_base_device: Floats, rotation_rad: Floats) -> Floats:
    """(3, 3) mean orientation of the target on the flange, from rotation vectors (pose, 3) in the device's axes."""
    flange = Rotation.from_matrix(T_base_flange[:, :3, :3])
    seen = Rotation.from_matrix(R_base_device) * Rotation.from_rotvec(rotation_rad)
    return (flange.inv() * seen).mean().as_matrix()


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(*POSITION, *ORIENTATION)
    if len(rows) == 0:
        return None
    seen = table.stacked(ORIENTATION)[rows]
    device = table.device().T_base_device if table.alignment is None else table.alignment.T_a_b
    mount = mounted(table.T_base_flange[rows], device[:3, :3], seen)
    sensor = FullPose(table.target, table.device(), Rotation.from_rotvec(seen).as_matrix(), mount)
    observed, sigma, turn = np.zeros((len(rows), 6)), np.zeros((len(rows), 6)), np.zeros((len(rows), 6))
    observed[:, :3], sigma[:, :3] = table.position_m[rows], position_sigma_m(table.rig)
    turn[:, 3:] = ORIENTATION_ASSUMED_RAD
    own = dict(zip((source.name for source in KIND.noise), (sigma, turn), strict=True))
    return table.measured(KIND.name, SensorChain(table.arm, sensor), rows, observed, own)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    """The turning half: positions have a witness of their own. Which way the target sits on the flange is found."""
    del rig
    rows = thinned(filled(samples, *POSITION, *ORIENTATION))
    if len(rows) < FEWEST_POSES:
        return None
    return OrientationWitness(q_rad[rows], stacked(samples, ORIENTATION)[rows])


def predicted_turns(R_device_target: Floats, samples: Samples, names: tuple[str, ...] = ORIENTATION) -> Columns:
    """Orientations (row, 3, 3) as rotation vectors under the names of columns, near the observed ones where any are."""
    vectors = Rotation.from_matrix(R_device_target).as_rotvec()
    if all(name in samples for name in names):
        vectors = _nearer_form(vectors, stacked(samples, names))
    return dict(zip(names, vectors.T, strict=True))


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    turns = device_of(found)[:3, :3].T @ T_base_flange[:, :3, :3] @ found.turn_of_target()
    return predicted_positions(found, T_base_flange, samples) | predicted_turns(turns, samples)


def _nearer_form(vectors: Floats, observed: Floats) -> Floats:
    """(row, 3) the same rotations: of turns near half a turn the vector that is next to the observed one.

    A turn by an angle about an axis is one by the angle less 2 pi about the same axis.
    """
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    turned_back = vectors * (1.0 - 2.0 * np.pi / np.maximum(angle, np.finfo(float).eps))
    nearer = np.linalg.norm(turned_back - observed, axis=1) < np.linalg.norm(vectors - observed, axis=1)
    return np.where(nearer[:, None], turned_back, vectors)


KIND = SensorKind(
    name="full-pose",
    columns=POSITION,
    further=ORIENTATION,
    title="Measured poses",
    noun="positions",
    quantities=(Quantity("position", "m", 0, 3), Quantity("orientation", "rad", 3, 6)),
    noise=(NOISE, NoiseSource("orientation", "rad")),
    traits=frozenset({Trait.TARGET, Trait.DEVICE, Trait.IN_SPACE, Trait.ANGLE_ENCODERS}),
    reads=(*POSITION, *ORIENTATION),
    asks=ORIENTATION,
    build=_build,
    witness=_witness,
    predict=_predict,
)
