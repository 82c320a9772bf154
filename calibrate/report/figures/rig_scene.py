"""The rig in space, from the fit: arms at chosen poses, faces where they stood, the beam from laser to second face."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.assumed_rig import AssumedRig
from calibrate.model.dual_psd_rig import fixture_of
from calibrate.model.observations import Observations
from calibrate.model.optics import AXES
from calibrate.model.rigid import pose_offset
from calibrate.report.evidence.session_evidence import SpotSession

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FittedRig:
    """The rig with everything that the fit corrected."""

    assumed: AssumedRig
    T_psd1_psd2: Floats  # (4, 4)
    half_size_m: float

    def faces(self, placement: int) -> Floats:
        """(2, 4, 4) T_base_psd1, T_base_psd2 of one placement."""
        T_base_psd1 = self.assumed.T_base_psd1(placement)
        return np.stack([T_base_psd1, T_base_psd1 @ self.T_psd1_psd2])

    def struck_m(self, placement: int, first_psd: int, spots_m: Floats) -> Floats:
        """(2, 3) spots (4,) in the base frame, that of the face that is struck first in front."""
        faces = self.faces(placement)
        local = np.concatenate([spots_m.reshape(2, 2), np.zeros((2, 1))], axis=1)
        points = np.einsum("fij,fj->fi", faces[:, :3, :3], local) + faces[:, :3, 3]
        return points if first_psd == 1 else points[::-1]


def fitted_rig(session: SpotSession) -> FittedRig:
    """DataError for a rig without laser or fixture."""
    rig, corrections = session.rig, session.corrections
    fixture = fixture_of(rig)
    pair = pose_offset(np.array([corrections.get(f"psd2.{axis}", 0.0) for axis in AXES]))
    return FittedRig(AssumedRig(rig, corrections), fixture.T_psd1_psd2 @ pair, fixture.half_size_m)


@dataclass(frozen=True)
class StandingArm:
    """The arm at one recorded pose, in the base frame."""

    placement: int
    first_psd: int
    bones_m: Floats  # (corner, 3) from base to laser, along the axes and what leads across to the next
    axes_m: Floats  # (joint, 3) a point of each joint's axis: the origin in front of it
    beam_m: Floats  # (3, 3) laser, spot on the first face, spot on the second


@dataclass(frozen=True)
class Scene:
    """Everything that is drawn, in the base frame."""

    arms: tuple[StandingArm, ...]  # one a placement
    faces_m: dict[int, Floats]  # placement -> (2, 4, 3) corners of PSD 1, PSD 2


def scene(rig: FittedRig, data: Observations, places: tuple[int, ...]) -> Scene:
    """One arm a placement, at its best centred pose, and all faces."""
    h = rig.half_size_m
    square = np.array([[h, h, 0.0], [-h, h, 0.0], [-h, -h, 0.0], [h, -h, 0.0]])
    poses = {k: rig.faces(k) for k in places}
    return Scene(
        tuple(_standing(rig, data, most_centred(data, k)) for k in places),
        {k: square @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3] for k, T in poses.items()},
    )


def most_centred(data: Observations, placement: int, first_psd: int | None = None) -> int:
    """The pose of a placement (and order) whose spots are nearest to the centres."""
    wanted = data.placement == placement
    if first_psd is not None:
        wanted &= data.first_psd == first_psd
    off_m = np.abs(data.spots_m).max(axis=1)
    return int(np.argmin(np.where(wanted, off_m, np.inf)))


def _standing(rig: FittedRig, data: Observations, pose: int) -> StandingArm:
    q_rad, placement, first = data.q_rad[pose], int(data.placement[pose]), int(data.first_psd[pose])
    frames = rig.assumed.arm.frames(q_rad[None])[0]
    laser_m, _ = rig.assumed.beam(q_rad)
    beam_m = np.stack([laser_m, *rig.struck_m(placement, first, data.spots_m[pose])])
    return StandingArm(placement, first, _bones(frames, laser_m), frames[:-1, :3, 3], beam_m)


def _bones(frames: Floats, laser_m: Floats) -> Floats:
    """From the base to axis 1, from each frame along its axis and across to the next; at the end to the laser."""
    corners = [np.zeros(3), frames[0, :3, 3]]
    for before, after in itertools.pairwise(frames):
        along = before[:3, 2] * (before[:3, 2] @ (after[:3, 3] - before[:3, 3]))
        corners += [before[:3, 3] + along, after[:3, 3]]
    return np.stack([*corners, laser_m])
