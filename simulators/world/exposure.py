"""What the mechanisms of the moving arm are exposed to: its moves so far, its pace, the hour, temperatures.

Rows: the start, the moves that have ended, and last of all this moment. Mechanisms that remember (play) see the whole
history, the others look at the last row.

Temperatures of a rig that warms up after power-on.

A body that is heated evenly and cooled by the air around it follows 1 - exp(-t/tau) (Newton's law of cooling). Nothing
in the emulated geometry depends on them: heat that lengthens a link is a mechanism (`simulators.defects`).
"""

import math
from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from simulators.defects import Scene

Floats = NDArray[np.float64]
AMBIENT_DEGC = 22.0
JOINT_RISE_K = 12.0  # a UR5e at slow work reports about 30 to 35 degC in its joints after an hour
JOINT_TAU_S = 1800.0
PSD_RISE_K = 4.0  # a closed box with an amplifier; feels right
PSD_TAU_S = 900.0
LINK_SHARE = 0.45  # of what its motor warms to
LASER_RISE_K = 4.5
LASER_TAU_S = 600.0


def joint_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - JOINT_RISE_K * math.expm1(-time_s / JOINT_TAU_S)


def psd_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - PSD_RISE_K * math.expm1(-time_s / PSD_TAU_S)


def link_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC + LINK_SHARE * (joint_temperature_degC(time_s) - AMBIENT_DEGC)


def laser_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - LASER_RISE_K * math.expm1(-time_s / LASER_TAU_S)


STOOD_S = 0.050  # an unchanged set-point: what comes then is another move (as in repeatability.SEATING_S)
REMEMBERED = 400  # moves; a play of 0.1 mrad has forgotten all but the last few
NO_LOAD_KG = 0.0


class Exposure:
    """Follows the set-point. Joint vectors (n,) are the controller's own readings."""

    def __init__(self, q_rad: Floats, rest_degC: Mapping[str, float] | None = None) -> None:
        """`rest_degC`: by place, the temperature at which the rig is as drawn; none: that at power-on."""
        self._rest_degC = rest_degC or {}
        self._start_rad = q_rad.copy()
        self._via_rad, self._goal_rad = q_rad.copy(), q_rad.copy()
        self._changed_s = -STOOD_S
        self._moves: deque[tuple[Floats, Floats]] = deque(maxlen=REMEMBERED)

    def commanded(self, q_rad: Floats, time_s: float) -> None:
        """Another set-point."""
        if time_s - self._changed_s >= STOOD_S:
            if not np.array_equal(self._via_rad, self._goal_rad):
                self._moves.append((self._via_rad, self._goal_rad))
            self._via_rad = self._goal_rad
        self._goal_rad = q_rad.copy()
        self._changed_s = time_s

    def scene(self, time_s: float, qd_rad_s: Floats, placement: int) -> Scene:
        """The present moment in the last row."""
        moves = [(self._start_rad, self._start_rad), *self._moves, (self._via_rad, self._goal_rad)]
        rows = len(moves)

        def now(value: float | Floats) -> Floats:
            column = np.zeros((rows, *np.shape(value)))
            column[-1] = value
            return column

        return Scene(
            t_s=now(time_s),
            via_rad=np.array([via for via, _ in moves]),
            goal_rad=np.array([goal for _, goal in moves]),
            qd_rad_s=now(qd_rad_s),
            wait_s=now(max(time_s - self._changed_s, 0.0)),
            payload_kg=np.full(rows, NO_LOAD_KG),
            payload_com_m=np.zeros(3),
            placement=np.full(rows, placement, dtype=np.int64),
            first_psd=np.zeros(rows, dtype=np.int64),
            seat=np.zeros(rows, dtype=np.int64),
            temperature_degC=temperatures(np.array([0.0] * (rows - 1) + [time_s]), len(qd_rad_s)),
            laser_power=np.ones(rows),
            extra={},
            rest_degC=self._rest_degC,
        )


def temperatures(time_s: Floats, n_joints: int) -> Mapping[str, Floats]:
    """By place, (row,) degC: of an arm that works since power-on in a room that stays as it is."""
    laws = {"joint": joint_temperature_degC, "link": link_temperature_degC, "laser": laser_temperature_degC}
    warm = {where: np.array([law(t) for t in time_s.tolist()]) for where, law in laws.items()}
    found = {"room": np.full(len(time_s), AMBIENT_DEGC), "laser": warm["laser"]}
    for number in range(1, n_joints + 1):
        found |= {f"joint{number}": warm["joint"], f"link{number}": warm["link"]}
    return found
