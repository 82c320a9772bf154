"""One seed of each fault of a stream, with what is true of it: by own mechanics, and from the emulated world."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import plain_rig, rig_text
from benchmarks.moving_arm import STEP_S, Motion, followed, motion, sampled, swaying
from calibrate.diagnose.streams.track import Track
from simulators.world.world import World

Floats = NDArray[np.float64]

JOINT_NOISE_RAD, ENCODER_NOISE_RAD, SPOT_NOISE_M = 5e-6, 6e-6, 1e-6
LEVER_M = 0.5  # of a joint on a spot


@dataclass(frozen=True, eq=False)
class Scene:
    """One motion, true joints on its grid, and the devices' streams on true time."""

    rng: Generator
    motion: Motion
    q_rad: Floats  # (step, joint)
    stretch_s: float = 0.1  # left out at both ends: clocks may reach over

    @cached_property
    def lever_m(self) -> Floats:
        return self.rng.normal(0.0, LEVER_M, (4, self.q_rad.shape[1]))

    def times(self, rate_hz: float) -> Floats:
        end_s = float(self.motion.time_s[-1]) - self.stretch_s
        return np.arange(self.stretch_s + self.rng.uniform(0.0, 1.0 / rate_hz), end_s, 1.0 / rate_hz)

    def true(self, time_s: Floats) -> Floats:
        return sampled(self.motion.time_s, self.q_rad, time_s)

    def command(self, rate_hz: float = 500.0) -> Track:
        t = self.times(rate_hz)
        return Track("command", "rad", t, sampled(self.motion.time_s, self.motion.command_rad, t))

    def joints(self, rate_hz: float = 500.0) -> Track:
        t = self.times(rate_hz)
        return Track("joints", "rad", t, self._noisy(self.true(t), JOINT_NOISE_RAD))

    def encoders(self, rate_hz: float = 100.0) -> Track:
        """With zeros, discs off centre, and a twentieth of the frames lost, a second of them at once."""
        t = self.times(rate_hz)
        hole_s = self.rng.uniform(t[0], t[-1])
        t = t[(self.rng.random(len(t)) > 0.05) & (np.abs(t - hole_s) > 0.5)]
        q, n = self.true(t), self.q_rad.shape[1]
        disc = 1e-4 * np.cos(q + self.rng.uniform(0.0, 2.0 * np.pi, n))
        return Track("encoders", "rad", t, self._noisy(q + disc + self.rng.normal(0.0, 1e-2, n), ENCODER_NOISE_RAD))

    def spots(self, more_rad: Floats | float = 0.0, rate_hz: float = 1000.0) -> Track:
        """Spots without edges, on the motion's own grid where something is added to joint 2."""
        t = self.times(rate_hz)
        q = self.q_rad.copy()
        q[:, 1] += more_rad
        seen = sampled(self.motion.time_s, q, t) @ self.lever_m.T
        return Track("spots", "m", t, self._noisy(seen, SPOT_NOISE_M))

    def _noisy(self, values: Floats, sigma: float) -> Floats:
        return values + self.rng.normal(0.0, sigma, values.shape)


def servo_scene(seed: int, frequency_hz: float = 30.0, moves: int = 20, stand_s: float = 0.6) -> Scene:
    """Servos of second order, well damped."""
    rng = np.random.default_rng(seed)
    course = motion(rng, moves, stand_s=stand_s)
    return Scene(rng, course, followed(course.command_rad, frequency_hz, 1.0))


def world_scene(seed: int, rig_file: Path) -> Scene:
    """The emulators' own world: rigid bodies, servo, repeatability; true angles as ideal encoders would see them."""
    rng = np.random.default_rng(seed)
    course = motion(rng, 14)
    text = rig_text(rig_file)
    plain = plain_rig(text, str(rig_file))
    home = np.array(plain["motion"]["home_rad"], dtype=float)
    world = World.from_rig(plain, seed=seed, q_rad=home)
    q = np.empty_like(course.command_rad)
    for step, command in enumerate(course.command_rad):
        if step % 2 == 0:
            world.command(home + command)
        q[step] = world.joints().q_rad
        world.advance(world.time_s + STEP_S)
    return Scene(rng, Motion(course.time_s, home + course.command_rad, course.stands), q)


@dataclass(frozen=True)
class Clock:
    """true = own + offset_s + drift (own - middle_s)."""

    offset_s: float
    drift: float
    middle_s: float

    def own(self, true_s: Floats) -> Floats:
        return self.middle_s + (true_s - self.offset_s - self.middle_s) / (1.0 + self.drift)

    def offset_at(self, own_s: float) -> float:
        return self.offset_s + self.drift * (own_s - self.middle_s)


def drawn_clock(rng: Generator, track: Track) -> tuple[Clock, Track]:
    """Up to half a minute apart, drifting by some 100 us/s; each sample stamped 20 us early or late."""
    clock = Clock(rng.uniform(-30.0, 30.0), rng.normal(0.0, 1e-4), 0.0)
    stamped = clock.own(track.time_s) + rng.normal(0.0, 2e-5, len(track.time_s))
    return clock, Track(track.name, track.unit, stamped, track.values)


def sway_rad(scene: Scene, frequency_hz: float, damping: float, size_rad: float) -> Floats:
    """Of a part that joint 2 shakes: rms of `size_rad` just after the stops."""
    speed = np.gradient(scene.q_rad[:, 1], STEP_S)
    sway = swaying(np.gradient(speed, STEP_S), frequency_hz, damping)
    after = [round((begin + 0.06) / STEP_S) for begin, _ in scene.motion.stands[1:]]
    return sway * size_rad / float(np.sqrt(np.mean(sway[after] ** 2)))


Scenes = Callable[[int], Scene]
