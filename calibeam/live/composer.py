"""Makes the messages of a page from the newest that was reported; once for all open pages."""

from math import isfinite, pi

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibeam.live.health import DeviceReadings, Latest, Watch, asked_rates
from calibeam.live.messages import (
    FaceNow,
    Job,
    LineMessage,
    Picture,
    PictureMessage,
    RigMessage,
    Scene,
    SceneFixture,
    StateMessage,
    StopMessage,
    TroubleMessage,
    faces_now,
    measured_m,
)
from calibeam.software import SOFTWARE

Floats = NDArray[np.float64]

SHOWN_LINES = 8  # of the log
READINGS = (("robot", "actual_q_rad"), ("encoders", "position_rad"))  # the first that is fresh gives the joints


class Composer:
    """Of one rig; used by one thread."""

    def __init__(self, rig: Rig, latest: Latest, job: Job) -> None:
        self._rig, self._latest = rig, latest
        self._job: Job = job
        self._watch, self._scene = Watch(asked_rates(rig)), Scene(rig)
        self._standing: SceneFixture | None = None
        self._number = 0
        self._encode = msgspec.json.Encoder().encode

    def rig(self) -> str:
        """RigSays."""
        rig = self._rig
        joints = rig.arm.joints
        limits_rad = [(joint.lower_rad, joint.upper_rad) for joint in joints]
        if rig.devices.encoders is not None and not joints:
            limits_rad = [(-pi, pi)] * len(rig.devices.encoders.named)
        return self._text(
            RigMessage(
                rig.name,
                self._job,
                SOFTWARE,
                [lower_rad for lower_rad, _ in limits_rad],
                [upper_rad for _, upper_rad in limits_rad],
                list(self._watch.asked_hz),
                None if rig.fixture is None else rig.fixture.half_size_m,
                self._reach_m(),
            )
        )

    def state(self) -> str:
        """State; also finds out where the fixture stands, if nobody states it."""
        latest, now_s = self._latest, self._latest.clock.now_s()
        devices = [self._watch.look(name, latest.of(name), now_s) for name in self._watch.asked_hz]
        self._scene.believe(latest.rig or self._rig, latest.corrections)
        q_rad, _ = self._joints(now_s)
        frames = None if q_rad is None else self._scene.frames(q_rad)
        flange = None if frames is None else frames[-1]
        self._standing = self._scene.standing(latest.standing, flange, measured_m(self._faces(now_s)))
        newest = latest.lines[-SHOWN_LINES:]
        lines = [LineMessage(line.number, round(now_s - line.host_s, 1), line.text) for line in newest]
        return self._text(StateMessage(devices, latest.where, lines, self._stop(now_s), self._standing))

    def now(self) -> str:
        """Now."""
        now_s = self._latest.clock.now_s()
        self._number += 1
        q_rad, by = self._joints(now_s)
        frames = None if q_rad is None else self._scene.frames(q_rad)
        beam = None if frames is None else self._scene.beam(frames[-1], self._standing)
        return self._text(
            PictureMessage(
                self._number,
                self._faces(now_s),
                None if q_rad is None else [round(q, 6) if isfinite(q) else None for q in q_rad.tolist()],
                by,
                None if frames is None else frames[:, :3, 3].round(5).tolist(),
                beam,
            )
        )

    def trouble(self, of: Picture, error: Exception) -> str:
        """Trouble."""
        says = f"calibeam cannot make this picture ({type(error).__name__}: {error}); what you see is old"
        return self._text(TroubleMessage(of, says))

    def _stop(self, now_s: float) -> StopMessage:
        stop = self._latest.stop
        if stop.last is None:
            return StopMessage(stop.ready)
        last = stop.last
        age_s = round(now_s - last.host_s, 3)  # by it a page knows whether its own press was sooner
        return StopMessage(stop.ready, age_s, last.delivered, last.who, last.says)

    def _fresh(self, device: str, now_s: float) -> DeviceReadings | None:
        heard = self._latest.of(device)
        return heard if self._watch.fresh(device, heard, now_s) else None

    def _faces(self, now_s: float) -> tuple[FaceNow, FaceNow] | None:
        heard, view = self._fresh("psd", now_s), self._latest.view
        return None if heard is None or heard.block is None or view is None else faces_now(view, heard.block)

    def _joints(self, now_s: float) -> tuple[Floats | None, str]:
        """Readings (joint,) and their device."""
        for device, name in READINGS:
            heard = self._fresh(device, now_s)
            if heard is not None and heard.block is not None and name in heard.block.values:
                return np.asarray(heard.block.values[name][-1], dtype=np.float64), device
        return None, ""

    def _reach_m(self) -> float:
        frames = self._scene.frames(np.zeros(self._rig.n_joints))
        if frames is None:  # a rig of encoders alone: nothing to draw
            return 0.0
        return round(float(np.linalg.norm(np.diff(frames[:, :3, 3], axis=0), axis=1).sum()), 3)

    def _text(self, message: msgspec.Struct) -> str:
        return self._encode(message).decode()
