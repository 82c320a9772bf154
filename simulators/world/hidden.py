"""Mechanisms of `simulators.defects` at work in the moving world.

What turns a joint or falsifies its encoder goes into the angle that the servo sees; what moves base, links or tool
bends the beam; what moves the fixture or distorts a reading acts on the light. Everything is worked out anew every few
steps and held in between (a beam that is off by 1e-4 for each metre of motion errs by 1e-6 m meanwhile).

What it does not imitate: the load is that of the arm as it stands, without the bend of links and base (1e-4 of 1e-4).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames
from simulators.arm.rigid import inverse
from simulators.arm.statics import Load, weigh
from simulators.defects.defect import (
    ChangesSums,
    Defect,
    DistortsSpots,
    MovesBase,
    MovesFixture,
    MovesLink,
    MovesTool,
    ReadsAngle,
    TurnsJoint,
)
from simulators.defects.scene import Scene
from simulators.world.optics import Ray

Floats = NDArray[np.float64]
GROUND = np.eye(4)[np.newaxis]


class Hidden:
    """What the mechanisms do at the last moment that they were asked about."""

    def __init__(self, defects: Sequence[Defect], arm: Arm) -> None:
        """`arm`: the true one, with its masses."""
        self._turners = [d for d in defects if isinstance(d, TurnsJoint)]
        self._readers = [d for d in defects if isinstance(d, ReadsAngle)]
        self._bases = [d for d in defects if isinstance(d, MovesBase)]
        self._links = [d for d in defects if isinstance(d, MovesLink)]
        self._tools = [d for d in defects if isinstance(d, MovesTool)]
        self._fixtures = [d for d in defects if isinstance(d, MovesFixture)]
        self.at_the_light = [d for d in defects if isinstance(d, (DistortsSpots, ChangesSums))]
        self._arm = arm
        self.turn_rad: Floats = np.zeros(arm.n_joints)  # true angle less reading, beside zero and repeatability
        self.fixture: Floats | None = None  # motion of the fixture in its own frame; None: it stands still
        self.scene: Scene | None = None
        self._extra_rad: Floats = np.zeros(arm.n_joints)
        self._bend: Floats = np.eye(4)

    def felt(self, scene: Scene, joint_rad: Floats, offset_rad: Floats, turning: Floats, flange: Floats) -> None:
        """Works it out for an arm at `joint_rad` (n,), of which `offset_rad` (n,) is zero and repeatability.

        `turning` (n, 4, 4) and `flange` (4, 4): where its frames are, in the base.
        """
        self.scene = scene
        shaft_rad = np.tile(joint_rad - offset_rad - self._extra_rad, (len(scene), 1))
        if self._turners or self._bases or self._links or self._tools:
            load = self._load(turning, flange, len(scene))
            turns = (turner.extra_turn_rad(shaft_rad, scene, load)[-1] for turner in self._turners)
            self._extra_rad = sum(turns, np.zeros_like(joint_rad))
            self._bend = self._bent(scene, load, joint_rad, turning, flange)
        errors = (reader.reading_error_rad(shaft_rad, scene)[-1] for reader in self._readers)
        self.turn_rad = self._extra_rad - sum(errors, np.zeros_like(joint_rad))
        if self._fixtures:
            motion = np.eye(4)
            for mover in self._fixtures:
                motion = motion @ mover.fixture_motion(scene)[-1]
            self.fixture = motion

    def bent(self, beam: Ray) -> Ray:
        """The beam where base, links and mount have carried it."""
        x, y, z = (self._bend[:3, :3] @ beam[:3] + self._bend[:3, 3]).tolist()
        dx, dy, dz = (self._bend[:3, :3] @ beam[3:]).tolist()
        return Ray(x, y, z, dx, dy, dz)

    def carried(self, pose: Floats) -> Floats:
        """The same of the flange (4, 4); the mount's own motion counts as the flange's."""
        return self._bend @ pose

    def _load(self, turning: Floats, flange: Floats, rows: int) -> Load:
        """The load of the moment in every row."""
        now = weigh(self._arm, Frames(turning[np.newaxis], flange[np.newaxis]), GROUND, np.zeros(1), np.zeros(3))
        return Load(
            *(
                np.repeat(values, rows, axis=0)
                for values in (now.torque_nm, now.payload_torque_nm, now.moment_nm, now.force_n, now.down_flange)
            )
        )

    def _bent(self, scene: Scene, load: Load, joint_rad: Floats, turning: Floats, flange: Floats) -> Floats:
        """(4, 4) in the base frame: motions of base, links and tool, each about where it takes place."""
        bend = np.eye(4)
        for base in self._bases:
            bend = base.base_motion(scene, load)[-1] @ bend
        angle_rad = np.tile(joint_rad, (len(scene), 1))
        for link in range(len(turning) + 1):
            here = np.eye(4) if link == 0 else turning[link - 1]
            end_m = self._arm.fixed[link, :3, 3]
            for mover in self._links:
                if link in mover.links:
                    bend = bend @ _about(here, mover.link_motion(link, end_m, angle_rad, scene, load)[-1])
        for mount in self._tools:
            bend = bend @ _about(flange, mount.tool_motion(scene, load)[-1])
        return bend


def _about(frame: Floats, motion: Floats) -> Floats:
    """A motion given in a frame, in the base."""
    return frame @ motion @ inverse(frame[np.newaxis])[0]
