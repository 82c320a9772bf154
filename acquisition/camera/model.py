"""A camera on the flange as believed: its lens, and where it sits; and the file that keeps both.

camera.json, version 1: see docs/formats.md.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError
from acquisition.motion.rigid import rotation_vector, transform
from acquisition.recording.rig_schema import Camera, Pose
from acquisition.recording.rig_values import Vector

Floats = NDArray[np.float64]

KIND = "calibeam-camera"


@dataclass(frozen=True, eq=False)
class CameraModel:
    """The lens in OpenCV's terms: pinhole and distortion k1, k2, p1, p2, k3 (Brown 1971)."""

    size_px: tuple[int, int]  # width, height
    matrix_px: Floats  # (3, 3)
    distortion: Floats  # (5,)
    T_flange_camera: Floats  # (4, 4); x right in the picture, y down, z where it looks


@dataclass(frozen=True)
class CameraFit:
    """How good a calibration is."""

    views: int
    reprojection_px: float  # rms of a coordinate
    board_m: float  # rms scatter of the board's place in the base over the views
    board_rad: float  # and of its turn
    lit: int = 0  # poses with light that told the beam
    beam_m: float | None = None  # rms scatter of the beam before the camera over them
    beam_rad: float | None = None


class _File(Struct, frozen=True):
    schema: int
    kind: str
    rig: str
    software: str
    width_px: int
    height_px: int
    matrix_px: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    distortion: tuple[float, float, float, float, float]
    in_flange: Pose
    views: int
    reprojection_px: float
    board_m: float
    board_rad: float
    lit: int = 0
    beam_m: float | None = None
    beam_rad: float | None = None


def drawn(camera: Camera) -> CameraModel:
    """As the rig file says it: a pinhole, and the mount as built."""
    focal_px = 0.5 * camera.width_px / np.tan(0.5 * camera.view_rad)
    matrix = np.array(
        [[focal_px, 0.0, 0.5 * camera.width_px], [0.0, focal_px, 0.5 * camera.height_px], [0.0, 0.0, 1.0]]
    )
    mount = transform(camera.in_flange.origin_m, camera.in_flange.rotation_rad)
    return CameraModel((camera.width_px, camera.height_px), matrix, np.zeros(5), mount)


def write_model(path: Path, model: CameraModel, fit: CameraFit, rig: str, software: str) -> None:
    """OSError where it cannot be written."""
    R, origin_m = model.T_flange_camera[:3, :3], model.T_flange_camera[:3, 3]
    text = {
        "schema": 1,
        "kind": KIND,
        "rig": rig,
        "software": software,
        "width_px": model.size_px[0],
        "height_px": model.size_px[1],
        "matrix_px": model.matrix_px.tolist(),
        "distortion": model.distortion.tolist(),
        "in_flange": {"origin_m": origin_m.tolist(), "rotation_rad": rotation_vector(R).tolist()},
        "views": fit.views,
        "reprojection_px": fit.reprojection_px,
        "board_m": fit.board_m,
        "board_rad": fit.board_rad,
        "lit": fit.lit,
        "beam_m": fit.beam_m,
        "beam_rad": fit.beam_rad,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")


def read_model(path: Path, camera: Camera) -> CameraModel:
    """AcquisitionError where the file is none, or is of a camera with other pictures."""
    try:
        file = msgspec.json.decode(path.read_bytes(), type=_File)
    except OSError as error:
        raise AcquisitionError(
            f"{path}: {error.strerror}; measure the camera first: calibeam camera RIG.toml"
        ) from error
    except msgspec.DecodeError as error:
        raise AcquisitionError(f"{path}: no camera calibration ({error}); measure it again: calibeam camera") from error
    size_px = (camera.width_px, camera.height_px)
    if file.kind != KIND or file.schema != 1 or (file.width_px, file.height_px) != size_px:
        raise AcquisitionError(
            f"{path}: kind {file.kind}, version {file.schema}, pictures of {file.width_px} x {file.height_px}; wanted "
            f"is {KIND}, 1, {size_px[0]} x {size_px[1]}; measure this camera: calibeam camera"
        )
    origin_m: Vector = file.in_flange.origin_m
    mount = transform(origin_m, file.in_flange.rotation_rad)
    return CameraModel(size_px, np.array(file.matrix_px), np.array(file.distortion), mount)
