"""A camera on the flange as assumed: its lens, and where it sits; and the file that keeps both.

camera.json, version 1: see docs/formats.md.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError
from acquisition.motion.kinematics import rotation_vector, transform
from acquisition.recording.files import JsonKind, read_json, shown
from acquisition.recording.files.bounds import Correction, Count, Label, Pixels, Statistic, Vector
from acquisition.recording.output import json_output, write_output
from acquisition.recording.rig import Camera, Pose

Floats = NDArray[np.float64]

KIND = "calibeam-camera"
FILE = JsonKind(
    "camera calibration",
    "measure the camera first: calibeam camera RIG.toml",
    "measure it again: calibeam camera",
    AcquisitionError,
)
_Row = tuple[Correction, Correction, Correction]  # of the camera matrix, pixels


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
    lit: int = 0  # poses with light that gave the beam
    beam_m: float | None = None  # rms scatter of the beam before the camera over them
    beam_rad: float | None = None


class _File(Struct, frozen=True):
    schema: Count
    kind: Label
    rig: Label
    software: Label
    width_px: Pixels
    height_px: Pixels
    matrix_px: tuple[_Row, _Row, _Row]
    distortion: tuple[Correction, Correction, Correction, Correction, Correction]
    in_flange: Pose
    views: Count
    reprojection_px: Statistic
    board_m: Statistic
    board_rad: Statistic
    lit: Count = 0
    beam_m: Statistic | None = None
    beam_rad: Statistic | None = None


def drawn(camera: Camera) -> CameraModel:
    """As the rig file states it: a pinhole, and the mount as built."""
    focal_px = 0.5 * camera.width_px / np.tan(0.5 * camera.view_rad)
    matrix = np.array(
        [[focal_px, 0.0, 0.5 * camera.width_px], [0.0, focal_px, 0.5 * camera.height_px], [0.0, 0.0, 1.0]]
    )
    mount = transform(camera.in_flange.origin_m, camera.in_flange.rotation_rad)
    return CameraModel((camera.width_px, camera.height_px), matrix, np.zeros(5), mount)


def write_model(path: Path, model: CameraModel, fit: CameraFit, rig: str, software: str) -> None:
    """OutputError, OSError as `write_output`."""
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
    write_output(path, json.dumps(text, indent=1) + "\n", json_output(KIND))


def read_model(path: Path, camera: Camera) -> CameraModel:
    """AcquisitionError where the file is none, or is of a camera with other pictures."""
    size_px = (camera.width_px, camera.height_px)

    def other(content: dict[str, Any]) -> str | None:
        kind, version = content.get("kind"), content.get("schema")
        pictures = (content.get("width_px"), content.get("height_px"))
        if kind == KIND and version == 1 and pictures == size_px:
            return None
        return (
            f"kind {shown(kind, 40)}, version {shown(version, 20)}, pictures of {shown(pictures[0], 20)} x "
            f"{shown(pictures[1], 20)}; wanted is {KIND}, 1, {size_px[0]} x {size_px[1]}; measure this camera: "
            "calibeam camera"
        )

    file = read_json(path, FILE, _File, other)
    origin_m: Vector = file.in_flange.origin_m
    mount = transform(origin_m, file.in_flange.rotation_rad)
    return CameraModel(size_px, np.array(file.matrix_px), np.array(file.distortion), mount)
