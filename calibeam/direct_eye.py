"""The emulated camera without a wire: its pictures are those that the emulator sends."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.camera.eye import Grey
from simulators.camera.emulator import Eye
from simulators.camera.true_camera import TrueCamera
from simulators.world.world import World

Floats = NDArray[np.float64]


class DirectEye:
    """Implements acquisition.camera.eye.Eye over a world in this process."""

    def __init__(self, world: World, plain_rig: Mapping[str, Any]) -> None:
        self._eye = Eye(world, plain_rig, world.truth.seed)

    @property
    def camera(self) -> TrueCamera:
        """What it truly is; for tests."""
        return self._eye.camera

    def picture(self) -> Grey:
        return self._eye.take(self._eye.scene())

    def taken(self, T_camera_board: Floats) -> Grey:
        """A picture of the board at a pose (4, 4) of its own, wherever the world has it."""
        return self._eye.take(T_camera_board)
