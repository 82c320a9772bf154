"""Standard Denavit-Hartenberg arm with Hayati's extra tilt on every link.

T_i = Rz(q_i + theta_offset_i + zero_i) Tz(d_i + offset_i) Tx(a_i + length_i) Rx(alpha_i + twist_i) Ry(tilt_i),
T_base_flange = T_1 ... T_n T_n_flange.
Sources: Denavit, Hartenberg, J. Appl. Mech. 22, 1955; Hayati, Mirmirani, J. Robotic Systems 2(4), 1985 (tilt, there
for near-parallel axes only). On a link with alpha = +-90 deg the tilt turns about an axis parallel to the link's own
joint: zero and tilt then only add up. So there the tilt is held, and `joint.zero` is by definition the whole turn.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter
from calibrate.rigid import inverse, slide_twist, turn_twist

Floats = NDArray[np.float64]

ZERO_PLAUSIBLE_RAD = 0.0785  # 4.5 deg: the bound of the point-constraint paper (Deng, Ding, Zhang 2019)
PER_LINK = 5  # zero, offset, length, twist, tilt
PARALLEL_COSINE = 0.9  # of the twist: within 25 deg of parallel a tilt is something of its own


@dataclass(frozen=True)
class DhLink:
    """Nominal values of one axis and the link behind it."""

    theta_offset_rad: float
    d_m: float
    a_m: float
    alpha_rad: float


@dataclass(frozen=True)
class _Frames:
    """Everything the derivatives need, for all poses; T_base_i is the frame behind link i."""

    T_base_link: Floats  # (pose, joint + 1, 4, 4); index 0 is the base
    T_base_flange: Floats  # (pose, 4, 4)
    angle_rad: Floats  # (pose, joint)


class DhArm:
    """KinematicModel of a standard D-H table; all parameters are corrections to it."""

    def __init__(
        self,
        links: tuple[DhLink, ...],
        length_sigma_m: float,
        angle_sigma_rad: float,
        T_last_flange: Floats | None = None,
    ) -> None:
        """Drawing tolerances (one sigma) become the priors of lengths and angles; joint zeros have none."""
        self._nominal = np.array([[k.theta_offset_rad, k.d_m, k.a_m, k.alpha_rad, 0.0] for k in links])
        self._T_last_flange = np.eye(4) if T_last_flange is None else T_last_flange
        self.n_joints = len(links)
        self.parameters = tuple(
            p
            for i, link in enumerate(links, start=1)
            for p in _link_parameters(i, link, length_sigma_m, angle_sigma_rad)
        )

    def flange(self, theta: Floats, q_rad: Floats) -> Floats:
        return self._frames(theta, q_rad).T_base_flange

    def joint_twists(self, theta: Floats, q_rad: Floats) -> Floats:
        before = self._frames(theta, q_rad).T_base_link[:, :-1]
        return np.swapaxes(turn_twist(before[..., :3, 2], before[..., :3, 3]), 1, 2)

    def twists(self, theta: Floats, q_rad: Floats) -> Floats:
        frames = self._frames(theta, q_rad)
        before, after = frames.T_base_link[:, :-1], frames.T_base_link[:, 1:]
        z, x0, y0 = before[..., :3, 2], before[..., :3, 0], before[..., :3, 1]
        c, s = np.cos(frames.angle_rad)[..., None], np.sin(frames.angle_rad)[..., None]
        x = c * x0 + s * y0  # the common normal, along which length and about which twist act
        end_m = after[..., :3, 3]
        columns = [
            turn_twist(z, before[..., :3, 3]),
            slide_twist(z),
            slide_twist(x),
            turn_twist(x, end_m),
            turn_twist(after[..., :3, 1], end_m),  # Ry leaves its own axis where it was
        ]
        stacked = np.stack(columns, axis=-1)  # (pose, joint, 6, 5)
        return np.moveaxis(stacked, 1, 2).reshape(len(q_rad), 6, PER_LINK * self.n_joints)

    def link_tail(self, theta: Floats) -> Floats:
        """(joint, 4, 4) constant part of each link: Tz Tx Rx Ry."""
        _, d, a, alpha, tilt = (self._nominal + theta.reshape(-1, PER_LINK)).T
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(tilt), np.sin(tilt)
        out = np.zeros((self.n_joints, 4, 4))
        out[:, 0, 0], out[:, 0, 2], out[:, 0, 3] = cb, sb, a
        out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = sa * sb, ca, -sa * cb
        out[:, 2, 0], out[:, 2, 1], out[:, 2, 2], out[:, 2, 3] = -ca * sb, sa, ca * cb, d
        out[:, 3, 3] = 1.0
        out[-1] = out[-1] @ self._T_last_flange
        return out

    def angle_offset_rad(self, theta: Floats) -> Floats:
        """(joint,) what is added to a joint reading: theta_offset + zero."""
        return self._nominal[:, 0] + theta[::PER_LINK]

    def _frames(self, theta: Floats, q_rad: Floats) -> _Frames:
        angle = q_rad + self.angle_offset_rad(theta)
        c, s = np.cos(angle), np.sin(angle)
        tails = self.link_tail(theta)
        T = np.empty((len(q_rad), self.n_joints + 1, 4, 4))
        T[:, 0] = np.eye(4)
        for i in range(self.n_joints):
            turned = T[:, i].copy()
            ci, si = c[:, i, None], s[:, i, None]
            turned[:, :, 0] = ci * T[:, i, :, 0] + si * T[:, i, :, 1]
            turned[:, :, 1] = ci * T[:, i, :, 1] - si * T[:, i, :, 0]
            T[:, i + 1] = turned @ tails[i]
        flange = T[:, -1].copy()
        T[:, -1] = flange @ inverse(self._T_last_flange)
        return _Frames(T, flange, angle)


def _link_parameters(i: int, link: DhLink, length_sigma_m: float, angle_sigma_rad: float) -> tuple[Parameter, ...]:
    tilt_sigma_rad = angle_sigma_rad if abs(math.cos(link.alpha_rad)) > PARALLEL_COSINE else 0.0
    return (
        Parameter(f"joint{i}.zero", "rad", ZERO_PLAUSIBLE_RAD),
        _as_drawn(f"link{i}.offset", "m", length_sigma_m),
        _as_drawn(f"link{i}.length", "m", length_sigma_m),
        _as_drawn(f"link{i}.twist", "rad", angle_sigma_rad),
        _as_drawn(f"link{i}.tilt", "rad", tilt_sigma_rad),
    )


def _as_drawn(name: str, unit: str, sigma: float) -> Parameter:
    """Believed to `sigma`; held where that is zero."""
    if sigma > 0.0:
        return Parameter(name, unit, sigma, prior=sigma)
    return Parameter(name, unit, 1e-3, free=False)
