"""The emulators with trouble that no wire knows of: it sits in shafts, filters and springs. A process of its own.

    python -m benchmarks.disturbed RIG '{"slip_joint": 5, "slip_rad": 4e-4, "slip_s": 20.0}' SEED TIME_SCALE

Announces where its devices listen as `calibeam emulate --json` does; clocks, lines and doubled frames are disturbed
through its side channel ("fault.inject").
"""

import json
import sys
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import simulators.serve
from acquisition.recording.rig import plain_rig, rig_text
from simulators.world.model import STEP_S
from simulators.world.optics import Knot, Ray, interpolate, sample_a
from simulators.world.world import World

Floats = NDArray[np.float64]
STOPPED_RAD_S = 5e-3  # of the fastest joint: from then on what hangs at the arm swings by itself
REMEMBERED = 400  # steps of 1 ms


@dataclass(frozen=True)
class Trouble:
    """What is wrong; joints from 1, 0: nothing of it."""

    slip_joint: int = 0
    slip_rad: float = 0.0
    slip_s: float = 0.0  # emulated time
    lag_joint: int = 0  # its link encoder delivers late
    lag_s: float = 0.0
    late_samples: int = 0  # of the PSD box: content older than its stamp
    swing_hz: float = 0.0  # of the column under joint 1 after a stop
    swing_damping: float = 0.03
    swing_rad: float = 0.0
    creep_rad: float = 0.0  # that joint 1 still turns after a stop
    creep_s: float = 0.0  # time constant


class DisturbedWorld(World):
    """Turns of joint 1 that the controller does not see are turns of the beam about the base's z."""

    trouble = Trouble()

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._stopped_s: float | None = None
        self._past: deque[tuple[float, Floats]] = deque(maxlen=REMEMBERED)
        self._late: deque[Floats] = deque()

    def advance(self, until_s: float) -> None:
        super().advance(until_s)
        moves = bool(np.max(np.abs(self.joints().qd_rad_s)) > STOPPED_RAD_S)
        if moves:
            self._stopped_s = None
        elif self._stopped_s is None:
            self._stopped_s = self.time_s
        self._past.append((self.time_s, super().link_encoders_rad() + self._turn(self.time_s) * np.eye(1, 6)[0]))

    def link_encoders_rad(self) -> Floats:
        trouble, now = self.trouble, super().link_encoders_rad() + self._turn(self.time_s) * np.eye(1, 6)[0]
        if trouble.lag_joint and self._past:
            joint = trouble.lag_joint - 1
            t, past = zip(*self._past, strict=True)
            now[joint] = np.interp(self.time_s - trouble.lag_s, t, [one[joint] for one in past])
        if trouble.slip_joint and self.time_s > trouble.slip_s:
            now[trouble.slip_joint - 1] += trouble.slip_rad
        return now

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats:
        times = [float(t) for t in times_s]
        if not times:
            return super().photocurrents_a(times)
        rows = [self._currents(t) for t in times]
        fresh = sample_a(np.concatenate(rows), self._rate_hz, self._noise)
        self._late.extend(fresh)
        while len(self._late) < self.trouble.late_samples + len(fresh):
            self._late.appendleft(fresh[0])
        return np.array([self._late.popleft() for _ in fresh])

    def _currents(self, t_s: float) -> Floats:
        """(1, 2, 8) at one time, by the beam as it swings then."""
        at = min(int((t_s - self._knots_start_s) / STEP_S + 1e-6), len(self._knots) - 1)
        knot = Knot(_about_z(self._knots[at].beam, self._turn(t_s)))
        return interpolate([knot], t_s, [t_s], self._see)

    def _turn(self, t_s: float) -> float:
        """Angle of joint 1 beyond what the controller sees."""
        trouble = self.trouble
        if self._stopped_s is None:
            return trouble.creep_rad
        since_s = max(t_s - self._stopped_s, 0.0)
        turn = trouble.creep_rad * np.exp(-since_s / trouble.creep_s) if trouble.creep_s else 0.0
        if trouble.swing_hz:
            w, z = 2.0 * np.pi * trouble.swing_hz, trouble.swing_damping
            turn += trouble.swing_rad * np.exp(-z * w * since_s) * np.sin(w * np.sqrt(1.0 - z**2) * since_s)
        return float(turn)


def _about_z(beam: Ray, angle_rad: float) -> Ray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z, dx, dy, dz = beam
    return Ray(c * x - s * y, s * x + c * y, z, c * dx - s * dy, s * dx + c * dy, dz)


def main(rig: Path, trouble: str, seed: int, time_scale: float) -> None:
    """Serves until standard input closes."""
    DisturbedWorld.trouble = Trouble(**json.loads(trouble))
    assert hasattr(simulators.serve, "World")  # the one place in which a server's world is made
    simulators.serve.World = DisturbedWorld
    options = simulators.serve.ServeOptions(
        robot_host="auto", seed=seed, time_scale=time_scale, links=False, end_with_stdin=True
    )
    simulators.serve.serve(
        plain_rig(rig_text(rig), str(rig)), options, lambda where: print(json.dumps(where), flush=True)
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
