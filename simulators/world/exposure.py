"""What the mechanisms of the moving arm are exposed to: its moves so far, its pace, the hour, temperatures.

Rows: the start, the moves that have ended, and last of all this moment. Mechanisms that remember (play) see the whole
history, the others look at the last row.
"""

from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from simulators.defects.scene import Scene
from simulators.world.warming import AMBIENT_DEGC, joint_temperature_degC, laser_temperature_degC, link_temperature_degC

Floats = NDArray[np.float64]
STOOD_S = 0.050  # an unchanged set-point: what comes then is another move (as in repeatability.SEATING_S)
REMEMBERED = 400  # moves; a play of 0.1 mrad has forgotten all but the last few
NO_LOAD_KG = 0.0


class Exposure:
    """Follows the set-point. Joint vectors (n,) are the controller's own readings."""

    def __init__(self, q_rad: Floats) -> None:
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
        )


def temperatures(time_s: Floats, n_joints: int) -> Mapping[str, Floats]:
    """By place, (row,) degC: of an arm that works since power-on in a room that stays as it is."""
    laws = {"joint": joint_temperature_degC, "link": link_temperature_degC, "laser": laser_temperature_degC}
    warm = {where: np.array([law(t) for t in time_s.tolist()]) for where, law in laws.items()}
    found = {"room": np.full(len(time_s), AMBIENT_DEGC), "laser": warm["laser"]}
    for number in range(1, n_joints + 1):
        found |= {f"joint{number}": warm["joint"], f"link{number}": warm["link"]}
    return found
