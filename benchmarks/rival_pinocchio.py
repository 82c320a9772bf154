"""Pinocchio on the same arm, one pose at a time from Python, as its users call it; only `make bench` installs it."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.compiled import ArmConstants

Floats = NDArray[np.float64]


class Rival:
    """A chain of revolute z joints between the arm's fixed parts; SystemExit with the remedy where it is missing."""

    def __init__(self, arm: ArmConstants) -> None:
        try:
            import pinocchio
        except ImportError as error:
            raise SystemExit("the speed benchmark compares with Pinocchio: run it by `make bench`") from error
        self._pin = pinocchio
        self._model, joint = pinocchio.Model(), 0
        for i, fixed in enumerate(arm.fixed[:-1]):
            joint = self._model.addJoint(joint, pinocchio.JointModelRZ(), pinocchio.SE3(fixed), f"joint{i + 1}")
        frame = pinocchio.Frame("flange", joint, 0, pinocchio.SE3(arm.fixed[-1]), pinocchio.FrameType.OP_FRAME)
        self._joint, self._flange = joint, self._model.addFrame(frame)
        self._data, self._offset_rad = self._model.createData(), arm.offset_rad

    def flanges(self, q_rad: Floats) -> Floats:
        """(pose, 4, 4)."""
        return np.array([self._at(q).homogeneous for q in q_rad + self._offset_rad])

    def points(self, point_m: Floats, q_rad: Floats) -> Floats:
        """(pose, 3) a point of the flange in the base."""
        return np.array([self._at(q).act(point_m) for q in q_rad + self._offset_rad])

    def regressors(self, point_m: Floats, q_rad: Floats) -> list[Floats]:
        """Derivative of the point's frame by all six errors of every fixed part, 6 x 6 joints: its nearest thing."""
        pin, local = self._pin, self._pin.SE3(np.eye(3), point_m)
        out: list[Floats] = []
        for q in q_rad + self._offset_rad:
            pin.forwardKinematics(self._model, self._data, q)
            out.append(
                pin.computeJointKinematicRegressor(
                    self._model, self._data, self._joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED, local
                )
            )
        return out

    def _at(self, q: Floats):
        self._pin.forwardKinematics(self._model, self._data, q)
        return self._pin.updateFramePlacement(self._model, self._data, self._flange)
