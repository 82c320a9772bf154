"""Streams of one motion as devices deliver them: own clocks, counters, and stamps of the host that come late."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from benchmarks.stream_cases import ENCODER_NOISE_RAD, Scene
from calibrate.diagnose.streams.recorded import StreamDevice
from calibrate.diagnose.streams.track import Track

EPOCHS_S = {"command": 3.0, "joints": 3.0, "encoders": -12.0, "spots": 40.0}  # nobody sets these clocks
HOST_S = 1000.0
LINE_S = 2e-4  # that a line delays, at least and usually


def delivered(
    rng: Generator, track: Track, epoch_s: float = 0.0, late_s: float = 0.0, drift: float = 0.0
) -> StreamDevice:
    """`late_s`: the device reads, waits so long, then stamps. `drift`: its seconds are shorter by that share."""
    stamped_s = track.time_s + late_s
    host_s = np.maximum.accumulate(HOST_S + stamped_s + LINE_S + rng.exponential(LINE_S, len(stamped_s)))
    return StreamDevice(
        replace(track, time_s=stamped_s * (1.0 + drift) + epoch_s), np.arange(len(stamped_s), dtype=np.int64), host_s
    )


def devices_of_scene(scene: Scene, late_s: Mapping[str, float], spots: Track | None = None) -> dict[str, StreamDevice]:
    """All four; readings of some are stamped late."""
    joints, command = scene.joints(), scene.command()
    wanted = np.stack([np.interp(joints.time_s, command.time_s, c) for c in command.values.T], axis=1)
    t = scene.times(100.0)
    encoders = scene.true(t) + 0.01 + scene.rng.normal(0.0, ENCODER_NOISE_RAD, (len(t), scene.q_rad.shape[1]))
    tracks = {
        "command": Track("command", "rad", joints.time_s, wanted),
        "joints": joints,
        "encoders": Track("encoders", "rad", t, encoders),
        "spots": scene.spots() if spots is None else spots,
    }
    return {name: delivered(scene.rng, track, EPOCHS_S[name], late_s.get(name, 0.0)) for name, track in tracks.items()}
