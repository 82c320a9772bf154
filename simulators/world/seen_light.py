"""What hidden mechanisms make of the light on the two faces: where the fixture stands, what the detectors say."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.rigid import moved
from simulators.conceal.readings import FULL_SUM_V
from simulators.defects.defect import ChangesSums, DistortsSpots
from simulators.defects.scene import Light, Scene
from simulators.world.hidden import Hidden
from simulators.world.optics import Face, Ray, Spot, Spots, meet, reflect
from simulators.world.rig import Pose

Floats = NDArray[np.float64]


def fixture_at(pose: Pose, motion: Floats) -> Pose:
    """A place of the fixture with its own motion (4, 4)."""
    there = moved(pose.origin_m, pose.rotation_rad) @ motion
    x, y, z = there[:3, 3].tolist()
    rx, ry, rz = Rotation.from_matrix(there[:3, :3]).as_rotvec().tolist()
    return Pose((x, y, z), (rx, ry, rz))


def seen(spots: Spots, beam: Ray, faces: tuple[Face, Face], hidden: Hidden) -> Spots:
    """The spots as the detectors say them; a face without light stays dark."""
    acting = hidden.at_the_light
    if not acting or hidden.scene is None or spots.psd1 is None or spots.psd2 is None:
        return spots
    scene = hidden.scene
    light = _light(spots.psd1, spots.psd2, _directions(spots.first, beam, faces), scene)
    seen_m, sum_v = light.spot_m, light.sum_v
    for defect in acting:
        if isinstance(defect, DistortsSpots):
            seen_m = defect.seen_spots_m(seen_m, light, scene)
        if isinstance(defect, ChangesSums):
            sum_v = defect.seen_sum_v(sum_v, scene)
    (x1_m, y1_m), (x2_m, y2_m) = seen_m[-1].tolist()
    share1, share2 = (sum_v[-1] / FULL_SUM_V).tolist()
    return Spots(Spot(x1_m, y1_m, share1), Spot(x2_m, y2_m, share2), spots.first)


def _light(one: Spot, two: Spot, direction: Floats, scene: Scene) -> Light:
    """The same light in every row: of mechanisms that look back, the last one counts."""
    rows = len(scene)
    spot_m = np.array([one[:2], two[:2]])
    sum_v = FULL_SUM_V * np.array([one.share, two.share])
    return Light(*(np.repeat(values[np.newaxis], rows, axis=0) for values in (spot_m, direction, sum_v)))


def _directions(first: int, beam: Ray, faces: tuple[Face, Face]) -> Floats:
    """(2, 3) of the arriving beam in the frame of PSD 1 and 2: direct at the first one, mirrored at the other."""
    near = faces[first - 1]
    struck = meet(beam, near)
    onward = beam if struck is None else reflect(beam, near, struck.distance_m)
    arriving = (beam, onward) if first == 1 else (onward, beam)
    axes = np.array([[face.axis_x, face.axis_y, face.normal] for face in faces])
    return np.einsum("fij,fj->fi", axes, np.array([ray[3:] for ray in arriving]))
