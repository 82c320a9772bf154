"""Sessions of every instrument from a concealed arm, by plain products of 4 x 4 matrices (tests/calibrate/conftest)."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples, read
from acquisition.recording.rig import load_rig
from acquisition.recording.rig.schema import Bar

TOOL = np.array([0.021, -0.012, 0.083])
TURN, SHIFT = Rotation.from_rotvec([0.3, -0.4, 2.2]), np.array([1.8, -0.6, 0.4])  # of the tracker, in the base
BAR_M = 0.4


class Session:
    """A UR5e whose links and zeros are a little beside the drawing; what its instruments would read."""

    def __init__(self, truth, seed=6):
        self.truth, self.rng = truth, np.random.default_rng(seed)

    def tips(self, q):
        """(row, 3) in the base: from the tool back through every link, turn by turn."""
        point = np.tile(TOOL, (len(q), 1))
        for j in reversed(range(6)):
            d, a, alpha, tilt = self.truth.links[j]
            point = Rotation.from_rotvec([alpha, 0, 0]).apply(Rotation.from_rotvec([0, tilt, 0]).apply(point))
            point = point + np.array([a, 0.0, d])
            point = Rotation.from_rotvec((q[:, j] + self.truth.zeros[j])[:, None] * [0, 0, 1]).apply(point)
        return point

    def readings(self, n):
        return self.rng.uniform(-1.8, 1.8, (n, 6))

    def reaching(self, goal):
        """Readings that bring the tip to points (row, 3), from many sides; and which were reached."""
        q = self.rng.uniform(-1.5, 1.5, (len(goal), 6))
        for _ in range(40):
            now = self.tips(q)
            J = np.stack([(self.tips(q + s) - now) / 1e-7 for s in np.eye(6) * 1e-7], axis=2)
            Jt = np.swapaxes(J, 1, 2)
            q = q + (Jt @ np.linalg.solve(J @ Jt + 1e-9 * np.eye(3), (goal - now)[..., None]))[..., 0].clip(-0.5, 0.5)
        return q, np.linalg.norm(self.tips(q) - goal, axis=1) < 1e-9

    def positions(self, q, noise_m):
        seen = TURN.inv().apply(self.tips(q) - SHIFT) + self.rng.normal(0.0, noise_m, (len(q), 3))
        return dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))


def table(q, **columns):
    readings = {f"q{i + 1}_rad": q[:, i] for i in range(6)}
    return Samples({"t_s": np.arange(len(q), dtype=float), **readings, **columns}, 6)


def changed(samples, **columns):
    """A copy with other columns."""
    return Samples({**{k: v.copy() for k, v in samples.columns.items()}, **columns}, samples.n_joints)


@pytest.fixture(scope="session")
def rig(request):
    drawn = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")
    tool = msgspec.structs.replace(drawn.tool, point_m=(0.02, -0.01, 0.08))
    return msgspec.structs.replace(drawn, tool=tool, bar_list=(Bar(1, BAR_M),))


@pytest.fixture
def session(ur5e_truth):
    return Session(ur5e_truth(np.random.default_rng(5), zero_max=5e-3))


@pytest.fixture(scope="session")
def real(request):
    """A real session by name; skipped where the data are not beside the project."""

    def open_session(name):
        folder = Path(request.config.rootpath).parent / "shared" / "data" / name
        if not folder.is_dir():
            pytest.skip(f"real data {name} not found in ../shared/data beside the project")
        return read(folder)

    return open_session
