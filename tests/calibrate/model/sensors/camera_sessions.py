"""Sessions of a concealed arm before a camera with a noise of its own along each axis, by plain 4 x 4 products."""

import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples

PLACE = ("camera_x_m", "camera_y_m", "camera_z_m")
TURN = ("camera_rx_rad", "camera_ry_rad", "camera_rz_rad")
SIGMA = np.array([5e-5, 8e-5, 1e-3, 5e-3, 4e-3, 5e-4])  # along x, y, z (m), about x, y, z (rad) of the camera
BODY = np.array([0.031, -0.052, 0.094]), Rotation.from_rotvec([0.4, -1.1, 0.7])  # on the flange
CAMERA = np.array([1.9, -0.7, 1.1]), Rotation.from_rotvec([1.2, -1.5, 0.6])  # in the base


class CameraSession:
    """A UR5e whose links and zeros are a little beside the drawing, seen by a camera in the room."""

    def __init__(self, truth, seed):
        self.truth, self.rng = truth, np.random.default_rng(seed)

    def flange(self, q):
        """(row, 3) origin and rotations of the flange in the base, link by link."""
        place, turn = np.zeros((len(q), 3)), Rotation.identity(len(q))
        for j in range(6):
            d, a, alpha, tilt = self.truth.links[j]
            turn = turn * Rotation.from_rotvec((q[:, j] + self.truth.zeros[j])[:, None] * [0, 0, 1])
            place = place + turn.apply([a, 0.0, d])
            turn = turn * Rotation.from_rotvec([alpha, 0, 0]) * Rotation.from_rotvec([0, tilt, 0])
        return place, turn

    def seen(self, q):
        """(row, 3) m and rotations of the body in the camera's frame, without noise."""
        place, turn = self.flange(q)
        in_base, back = place + turn.apply(BODY[0]), CAMERA[1].inv()
        return back.apply(in_base - CAMERA[0]), back * turn * BODY[1]

    def poses(self, n):
        return self.rng.uniform(-1.8, 1.8, (n, 6))

    def columns(self, q, sigma=SIGMA, names=(PLACE, TURN)):
        """What the camera reports: positions, and rotation vectors turned by the noise about the camera's axes."""
        place, turn = self.seen(q)
        noise = self.rng.normal(0.0, sigma, (len(q), 6))
        seen = np.concatenate([place + noise[:, :3], (Rotation.from_rotvec(noise[:, 3:]) * turn).as_rotvec()], axis=1)
        return dict(zip((*names[0], *names[1]), seen.T, strict=True))


def table(q, **columns):
    joints = {f"q{i + 1}_rad": q[:, i] for i in range(6)}
    return Samples({"t_s": np.arange(len(q), dtype=float), **joints, **columns}, 6)
