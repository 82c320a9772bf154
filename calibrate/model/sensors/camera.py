"""Instrument: a camera or a motion-capture system that stands in the room and measures position and orientation of a
body on the flange, with a noise of its own along and about each of its axes.

A camera is several times worse along its optical axis than across it, and turns of a body out of the picture plane are
seen worse than those within it. So each of the six has a sigma as stated and, as every source of noise, one that is
found from the residuals. The body's place on the flange and the camera's in the room are unknown, and found in closed
form: no rig states them to what a camera resolves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.alignment import align_with_tool
from calibrate.model.chain import SensorChain
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    filled,
    stacked,
    thinned,
)
from calibrate.model.placement import UNKNOWN_PLAUSIBLE_M, Device, Target
from calibrate.model.problem import Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.full_pose import (
    FullPose,
    OrientationWitness,
    mounted,
    predicted_turns,
)
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    Frame,
    NoiseSource,
    Quantity,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.position import FEWEST_POSES, PositionWitness

Floats = NDArray[np.float64]

PLACE = ("camera_x_m", "camera_y_m", "camera_z_m")
TURN = ("camera_rx_rad", "camera_ry_rad", "camera_rz_rad")
SOURCES = (
    *(NoiseSource(f"camera_{axis}", "m", "camera_m") for axis in "xyz"),
    *(NoiseSource(f"camera_r{axis}", "rad", "camera_rad") for axis in "xyz"),
)
# Start values where the rig's [noise] states none: a body of 0.1 m at 1.5 m, detected to 0.1 pixel of 0.3 mrad. Across
# the axis 45 µm / sqrt(markers); along it times range over size of the body. The data correct them.
ASSUMED_SIGMAS = (1e-4, 1e-4, 1e-3, 1e-2, 1e-2, 1e-3)
FRAME, BODY = "camera", "marker"  # first parts of the names of parameters


@dataclass(frozen=True)
class CameraWitness:
    """Positions and orientations of the body; camera and body are found."""

    place: PositionWitness
    turn: OrientationWitness

    @property
    def q_rad(self) -> Floats:
        return self.place.q_rad

    def strain(self, T_base_flange: Floats) -> Strain:
        return self.place.strain(T_base_flange) + self.turn.strain(T_base_flange)

    def otherwise(self) -> Iterator[Otherwise]:
        """Other conventions of either half."""
        for otherwise, place in self.place.written_otherwise():
            yield replace(otherwise, witness=replace(self, place=place))
        for otherwise, turn in self.turn.written_otherwise():
            yield replace(otherwise, witness=replace(self, turn=turn))


def camera_sigmas(rig: Rig) -> tuple[float, ...]:
    """(6,) one sigma along x, y, z (m) and about x, y, z (rad) of the camera, as stated or else as usual."""
    return (*(rig.noise.camera_m or ASSUMED_SIGMAS[:3]), *(rig.noise.camera_rad or ASSUMED_SIGMAS[3:]))


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(*PLACE)
    if len(rows) == 0:
        return None
    alone = np.setdiff1d(rows, table.filled(*PLACE, *TURN))
    if len(alone):
        raise DataError(
            f"samples row {alone[0] + 1}: {PLACE[0]} without {TURN[0]}; a camera measures position and orientation: "
            "complete the row, or write positions alone as x_m, y_m, z_m"
        )
    place_m, turn = table.stacked(PLACE)[rows], table.stacked(TURN)[rows]
    found, body_m = align_with_tool(table.T_base_flange[rows], place_m)
    mount = mounted(table.T_base_flange[rows], found.T_a_b[:3, :3], turn)
    sensor = FullPose(
        Target(body_m, UNKNOWN_PLAUSIBLE_M, BODY),
        Device(found.T_a_b, name=FRAME),
        Rotation.from_rotvec(turn).as_matrix(),
        mount,
    )
    observed = np.concatenate([place_m, np.zeros((len(rows), 3))], axis=1)
    sigmas = np.diag(camera_sigmas(table.rig))
    own = {source.name: np.tile(one, (len(rows), 1)) for source, one in zip(SOURCES, sigmas, strict=True)}
    return table.measured(KIND.name, SensorChain(table.arm, sensor), rows, observed, own)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    del rig  # neither the body's place nor the camera's is drawn
    rows = thinned(filled(samples, *PLACE, *TURN))
    if len(rows) < FEWEST_POSES:
        return None
    return CameraWitness(
        PositionWitness(q_rad[rows], stacked(samples, PLACE)[rows], None, columns=f"columns {', '.join(PLACE)}"),
        OrientationWitness(q_rad[rows], stacked(samples, TURN)[rows], columns=f"columns {', '.join(TURN)}"),
    )


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    if not {FRAME, BODY} <= set(found.about):
        raise DataError(f"model of rig {found.rig.name}: no camera in it; identify a session with {PLACE[0]} first")
    n = len(T_base_flange)
    here = FullPose(
        Target(np.zeros(3), name=BODY), Device(np.eye(4), name=FRAME), np.tile(np.eye(3), (n, 1, 1)), np.eye(3)
    )
    sensor = here.placed(found.about)
    seen = sensor.expect(found.values_of(sensor.parameters), T_base_flange)  # turns from the camera's own axes
    turns = Rotation.from_rotvec(seen[:, 3:]).as_matrix()
    return dict(zip(PLACE, seen[:, :3].T, strict=True)) | predicted_turns(turns, samples, TURN)


KIND = SensorKind(
    name="camera-pose",
    columns=PLACE,
    further=TURN,
    title="Poses measured by the camera",
    noun="camera poses",
    quantities=(Quantity("position", "m", 0, 3), Quantity("orientation", "rad", 3, 6)),
    noise=SOURCES,
    traits=frozenset({Trait.TARGET, Trait.DEVICE, Trait.IN_SPACE}),
    frames=(
        Frame(FRAME, "camera", "where the camera stands", numbers=6),
        Frame(BODY, "marker", "where the marker sits on the flange", numbers=6),
    ),
    reads=(*PLACE, *TURN),
    asks=PLACE,
    build=_build,
    witness=_witness,
    predict=_predict,
)
