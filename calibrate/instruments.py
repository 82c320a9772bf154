"""From a session's samples and its rig to the instruments that the columns allow, all at once, with a start value.

A column group makes an instrument wherever its cells are filled: spots, position (with an orientation: full pose),
wire, seat, bar; known distances between placements come from the rig. Frames and points that nobody states are found
in closed form from the arm as drawn, so that no start has to be guessed.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.columns import ORIENTATION, POSITION, SPOTS
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.alignment import Alignment
from calibrate.arms.catalogue import arm_of
from calibrate.arms.model import KinematicModel
from calibrate.chain import Chain
from calibrate.dual_psd_rig import believed_noise, dual_psd_of, laser_of
from calibrate.errors import DataError
from calibrate.joint_problem import Block
from calibrate.parameters import start_values
from calibrate.read_samples import Angles, observations
from calibrate.rigid import inverse
from calibrate.sample_table import Positions as Positions
from calibrate.sample_table import SampleTable
from calibrate.sample_table import Spots as Spots
from calibrate.sensors.bar import bar_pairs, consecutive_pairs, shared_correlation
from calibrate.sensors.dual_psd import DualPsd
from calibrate.sensors.encoder_difference import encoder_difference
from calibrate.sensors.full_pose import FullPose
from calibrate.sensors.known_distance import KnownDistances
from calibrate.sensors.pair import PairChain
from calibrate.sensors.point_line import PointLine, meeting_points
from calibrate.sensors.position import Position
from calibrate.sensors.seat import Seat, mean_tips
from calibrate.sensors.tip_distance import TipDistance
from calibrate.sensors.wire import Wire
from calibrate.weighting import Measured, Weighting
from calibrate.zeros.point_constraint import CENTRED_M

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

# Start values where the rig's [noise] says nothing; the examples of docs/formats.md. The data correct them.
POSITION_BELIEVED_M = 20e-6
WIRE_BELIEVED_M = 50e-6
SEAT_BELIEVED_M = 10e-6
LINE_BELIEVED_M = 5e-6  # how well the servo centres a spot
ORIENTATION_BELIEVED_RAD = 1e-4  # a 6-D target at a tracker is stated to 0.01 deg


@dataclass(frozen=True)
class Instruments:
    """What the samples allow. `weighting` makes problems of it."""

    weighting: Weighting
    start: Floats  # (param,) closed-form start values, in the order of weighting.parameters
    alignment: Alignment | None  # of the positions with the arm as drawn; says whether an axis is mirrored
    unused: Indices  # rows of the samples that hold no observation, or only one that could not be used


def instruments_of(
    samples: Samples,
    rig: Rig,
    *,
    arm: KinematicModel | None = None,
    angles: Angles = "reported",
    positions: Positions = Positions.FRAME,
    spots: Spots = Spots.REFLECTION,
    encoders: bool = False,
) -> Instruments:
    """All instruments of a session. `arm`: another model than the rig's own under its drawing tolerance.

    `encoders`: second encoders, too. They know no geometry: only effects at the joints make use of them.

    DataError where no row holds an observation, or where columns and rig contradict each other.
    """
    table = SampleTable(samples, rig, arm_of(rig) if arm is None else arm, angles, positions, spots)
    measured = tuple(instrument for build in BUILDERS for instrument in build(table))
    if not measured:
        raise DataError(
            "samples: no row holds an observation; columns of one are psd1_x_m ... with placement and first_psd, "
            "x_m y_m z_m, wire_m, seat, or bar with bar_end"
        )
    measured += encoder_difference(table) if encoders else ()
    weighting = Weighting(measured, believed_noise(rig).joint_rad, _known(table, measured))
    used = np.unique(np.concatenate([instrument.sample_rows.ravel() for instrument in measured]))
    unused = np.setdiff1d(np.arange(len(samples)), used)
    return Instruments(weighting, _start(table, weighting), table.alignment, unused)


def _dual_psd(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled(*SPOTS)
    if len(rows) == 0 or table.spots is Spots.POINT:
        return ()
    seen = observations(table.samples, table.angles)
    sensor = dual_psd_of(table.rig, seen.placement, seen.first_psd)
    sigma = np.full((len(rows), 4), believed_noise(table.rig).psd_m) if seen.sigma_m is None else seen.sigma_m
    return (table.measured("dual-psd", Chain(table.arm, sensor), rows, seen.spots_m, {"psd": sigma}),)


def _point_line(table: SampleTable) -> tuple[Measured, ...]:
    if table.spots is Spots.REFLECTION or len(table.filled(*SPOTS)) == 0:
        return ()
    seen = observations(table.samples, table.angles)
    centred = np.flatnonzero(np.abs(seen.spots_m).max(axis=1) <= CENTRED_M)
    rows, place = table.filled(*SPOTS)[centred], seen.placement[centred]
    if len(rows) == 0:
        raise DataError(
            f"samples: no row has all spots within {CENTRED_M} m of the centres; centre poses, or use spots"
        )
    mount = laser_of(table.rig)
    sensor = PointLine(mount, meeting_points(mount, table.T_base_flange[rows], place))
    own = {"line": np.full((len(rows), 2), LINE_BELIEVED_M)}
    chain = Chain(table.arm, sensor)
    return (table.measured("point", chain, rows, np.zeros((len(rows), 2)), own, condition=True),)


def _position(table: SampleTable) -> tuple[Measured, ...]:
    rows = np.setdiff1d(table.filled(*POSITION), table.filled(*POSITION, *ORIENTATION))
    if len(rows) == 0 or table.positions is Positions.DISTANCE:
        return ()
    sensor = Position(table.target, table.device)
    own = {"position": np.full((len(rows), 3), _position_sigma(table.rig))}
    return (table.measured("position", Chain(table.arm, sensor), rows, table.position_m[rows], own),)


def _full_pose(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled(*POSITION, *ORIENTATION)
    if len(rows) == 0 or table.positions is Positions.DISTANCE:
        return ()
    seen = Rotation.from_rotvec(table.stacked(ORIENTATION)[rows])
    device = table.device.T_base_device if table.alignment is None else table.alignment.T_a_b
    flange = Rotation.from_matrix(table.T_base_flange[rows, :3, :3])
    mounted = (flange.inv() * Rotation.from_matrix(device[:3, :3]) * seen).mean()
    sensor = FullPose(table.target, table.device, seen.as_matrix(), mounted.as_matrix())
    observed, sigma, turn = np.zeros((len(rows), 6)), np.zeros((len(rows), 6)), np.zeros((len(rows), 6))
    observed[:, :3], sigma[:, :3], turn[:, 3:] = (
        table.position_m[rows],
        _position_sigma(table.rig),
        ORIENTATION_BELIEVED_RAD,
    )
    own = {"position": sigma, "orientation": turn}
    return (table.measured("full-pose", Chain(table.arm, sensor), rows, observed, own),)


def _distance(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled(*POSITION)
    if len(rows) == 0 or table.positions is Positions.FRAME:
        return ()
    pairs, length_m = consecutive_pairs(rows, table.position_m[rows])
    own = {"position": np.full((len(pairs), 1), np.sqrt(2.0) * _position_sigma(table.rig))}
    measured = table.measured("distance", PairChain(table.arm, TipDistance(table.target)), pairs, length_m, own)
    return (replace(measured, own_correlation=shared_correlation(table.position_m, pairs)),)


def _wire(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled("wire_m")
    if len(rows) == 0:
        return ()
    length_m = table.samples.column("wire_m")[rows]
    if np.any(length_m <= 0.0):
        bad = int(np.argmax(length_m <= 0.0))
        raise DataError(
            f"samples row {rows[bad] + 1}, column 'wire_m': {length_m[bad]} m; a length is positive: empty the cell"
        )
    own = {"wire": np.full((len(rows), 1), table.rig.noise.wire_m or WIRE_BELIEVED_M)}
    return (table.measured("wire", Chain(table.arm, Wire(table.target, table.device)), rows, length_m[:, None], own),)


def _seat(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled("seat")
    if len(rows) == 0:
        return ()
    seat = table.samples.integers("seat", 0)[rows]
    sensor = Seat(table.target, mean_tips(table.tips_m[rows], seat))
    own = {"seat": np.full((len(rows), 3), table.rig.noise.seat_m or SEAT_BELIEVED_M)}
    chain = Chain(table.arm, sensor)
    return (table.measured("seat", chain, rows, np.zeros((len(rows), 3)), own, condition=True),)


def _bar(table: SampleTable) -> tuple[Measured, ...]:
    rows = table.filled("bar")
    if len(rows) == 0:
        return ()
    if "bar_end" not in table.samples:
        raise DataError("samples: column bar without bar_end; say which end, a or b, each row is")
    bar = table.samples.integers("bar", 0)
    pairs = bar_pairs(rows, bar[rows], table.samples.columns["bar_end"][rows])
    lengths = {k: b.length_m for k, b in table.rig.bars.items()}
    unknown = set(bar[rows].tolist()) - set(lengths)
    if unknown:
        raise DataError(f"samples: bar {min(unknown)} is not in the rig; add a [[bar]] with its length")
    length_m = np.array([[lengths[int(k)]] for k in bar[pairs[:, 0]]])
    own = {"seat": np.full((len(pairs), 1), np.sqrt(2.0) * (table.rig.noise.seat_m or SEAT_BELIEVED_M))}
    return (table.measured("bar", PairChain(table.arm, TipDistance(table.target)), pairs, length_m, own),)


# One line for each instrument; the order is that of blocks and parameters.
BUILDERS: tuple[Callable[[SampleTable], tuple[Measured, ...]], ...] = (
    _dual_psd,
    _point_line,
    _position,
    _full_pose,
    _distance,
    _wire,
    _seat,
    _bar,
)


def _known(table: SampleTable, measured: tuple[Measured, ...]) -> tuple[Block, ...]:
    """Known distances between placements that were both used; between others they say nothing."""
    for instrument in measured:
        chain = instrument.problem.chain
        if isinstance(chain, Chain) and isinstance(chain.sensor, DualPsd):
            used = set(chain.sensor.placement.tolist())
            listed = [d for d in table.rig.known_distances if {d.from_placement, d.to_placement} <= used]
            if not listed:
                return ()
            between = np.array([[d.from_placement, d.to_placement] for d in listed])
            length_m, sigma_m = np.array([d.length_m for d in listed]), np.array([d.sigma_m for d in listed])
            return (KnownDistances(chain.sensor, between, length_m, sigma_m),)
    return ()


def _position_sigma(rig: Rig) -> float:
    return rig.noise.position_m or POSITION_BELIEVED_M


def _start(table: SampleTable, weighting: Weighting) -> Floats:
    """Nominal, but a device that the rig places elsewhere than the data do starts where the data want it."""
    out = start_values(weighting.parameters)
    names = [p.name for p in weighting.parameters]
    if table.rig.device is None or table.alignment is None or "device.yaw" not in names:
        return out
    apart = inverse(table.device.T_base_device) @ table.alignment.T_a_b
    first = names.index("device.x")
    out[first : first + 3] = apart[:3, 3]
    out[first + 3 : first + 6] = Rotation.from_matrix(apart[:3, :3]).as_rotvec()
    return out
