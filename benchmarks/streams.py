"""Faults of streams, put in by own mechanics and by the emulated world: found or not, false alarms, errors of size."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.stream_cases import Scene, Scenes, drawn_clock, servo_scene, sway_rad, world_scene
from calibrate.diagnose.streams.clock import clock_between
from calibrate.diagnose.streams.continuity import Fault, breaks
from calibrate.diagnose.streams.following import following
from calibrate.diagnose.streams.ringing import ringing
from calibrate.diagnose.streams.settling import Window, stands_of, unsettled
from calibrate.diagnose.streams.slips import slips
from calibrate.diagnose.streams.track import Outcome, Track

Floats = NDArray[np.float64]

SEEDS = 30
FIRST = 1000  # seeds below were used while building


def lines(rig_file: Path, seeds: int = SEEDS) -> Iterator[str]:
    """One row a kind of fault."""
    drawn = range(FIRST, FIRST + seeds)
    yield f"{seeds} seeds each; errors as median and largest"

    def world(seed: int) -> Scene:
        return world_scene(seed, rig_file)

    yield _clock_line("clock, encoders against joints", [clock_case(servo_scene, s) for s in drawn])
    yield _clock_line("clock, the same, emulated world", [clock_case(world, s) for s in drawn])
    yield _clock_line("clock, spots against a model 1 % off", [spot_clock_case(s) for s in drawn])
    for name, made in (("delay", delay_case), ("first-order lag", lag_case)):
        results = [made(s) for s in drawn]
        right = sum(kind == name for _, kind in results)
        yield f"following error, {name}: {_spread([abs(e) for e, _ in results], '%')}; kind right {right}/{seeds}"
    rung = [ringing_case(s) for s in drawn]
    good = [r for r in rung if r is not None]
    yield (
        f"ringing: found {len(good)}/{seeds}; frequency {_spread([abs(r[0]) for r in good], '%')}; "
        f"damping {_spread([abs(r[1]) for r in good], '%')}; joint right {sum(r[2] for r in good)}/{len(good)}; "
        f"false {sum(quiet_case(s) for s in drawn)}/{seeds}"
    )
    slipped = [slip_case(s) for s in drawn]
    yield (
        f"encoder slips of 60 to 300 urad: found {sum(f for f, _, _ in slipped)}/{seeds}; size "
        f"{_spread([1e6 * e for f, e, _ in slipped if f], 'urad')}; false {sum(n for _, _, n in slipped)}"
    )
    settled = [settling_case(s) for s in drawn]
    found, of, false, healthy = (sum(r[k] for r in settled) for k in range(4))
    yield f"samples taken unsettled: found {found}/{of}; false {false}/{healthy}"
    broken = [breaks_case(s) for s in drawn]
    exact, more = (sum(r[k] for r in broken) for k in range(2))
    yield f"missed, double, backwards, frozen: exact {exact}/{seeds}; false {more}"


def clock_case(scenes: Scenes, seed: int) -> tuple[float, float, float] | None:
    """Error of offset (s), of drift (s/s), and offset in sigmas; None where none was found."""
    scene = scenes(seed)
    clock, own = drawn_clock(scene.rng, scene.encoders())
    fit = clock_between(scene.joints(float(scene.rng.choice([125.0, 500.0]))), own)
    if fit.offset_s is None or fit.drift is None or fit.offset_sigma_s is None:
        return None
    error_s = fit.offset_s - clock.offset_at(fit.middle_s)
    return error_s, fit.drift - clock.drift, error_s / fit.offset_sigma_s


def spot_clock_case(seed: int) -> tuple[float, float, float] | None:
    """Spots leave the faces between poses: a third of the time nothing is seen."""
    scene = servo_scene(seed)
    spots = scene.spots()
    dark = np.sin(2.0 * np.pi * spots.time_s / 3.1) > 0.5
    spots = replace(spots, values=np.where(dark[:, None], np.nan, spots.values))
    clock, own = drawn_clock(scene.rng, spots)
    joints = scene.joints()
    model = scene.lever_m * scene.rng.normal(1.0, 0.01, scene.lever_m.shape)
    fit = clock_between(Track("predicted", "m", joints.time_s, joints.values @ model.T), own)
    if fit.offset_s is None or fit.drift is None or fit.offset_sigma_s is None:
        return None
    error_s = fit.offset_s - clock.offset_at(fit.middle_s)
    return error_s, fit.drift - clock.drift, error_s / fit.offset_sigma_s


def delay_case(seed: int) -> tuple[float, str]:
    """Error in percent of joint 3's delay, and what it was called."""
    scene = servo_scene(seed)
    command, delay_s = scene.command(), scene.rng.uniform(8e-3, 2.5e-2)
    t = command.time_s[command.time_s > 0.2]
    late = Track("command", "rad", t - delay_s, np.empty((len(t), 0)))
    values = np.stack([np.interp(late.time_s, command.time_s, c) for c in command.values.T], axis=1)
    return _followed(command, Track("joints", "rad", t, values), scene, delay_s)


def lag_case(seed: int) -> tuple[float, str]:
    """A first-order filter, stepped exactly for a set-point that is straight between samples."""
    scene = servo_scene(seed)
    command, tau_s = scene.command(), scene.rng.uniform(8e-3, 2.5e-2)
    step_s = command.period_s
    fade = float(np.exp(-step_s / tau_s))
    ramp = tau_s / step_s * (1.0 - fade)
    values = np.empty_like(command.values)
    values[0] = command.values[0]
    for i in range(1, len(values)):
        before, now = command.values[i - 1], command.values[i]
        values[i] = fade * values[i - 1] + (ramp - fade) * before + (1.0 - ramp) * now
    return _followed(command, replace(command, name="joints", values=values), scene, tau_s)


def _followed(command: Track, reading: Track, scene: Scene, true_s: float) -> tuple[float, str]:
    noise = scene.rng.normal(0.0, 5e-6, reading.values.shape)
    found = following(command, replace(reading, values=reading.values + noise))[2]
    return 100.0 * ((found.behind_s or 0.0) / true_s - 1.0), found.kind


def ringing_case(seed: int) -> tuple[float, float, bool] | None:
    """Errors in percent of frequency and damping, and whether joint 2 was named; None where it was not found."""
    scene = servo_scene(seed, moves=12, stand_s=1.2)
    frequency_hz, damping = scene.rng.uniform(4.0, 25.0), scene.rng.uniform(0.01, 0.1)
    spots = scene.spots(sway_rad(scene, frequency_hz, damping, 1e-5))
    found = ringing(spots, stands_of(scene.command()), lambda _: scene.lever_m, 0.06)
    if found.frequency_hz is None or found.damping is None:
        return None
    apart = 100.0 * (found.frequency_hz / frequency_hz - 1.0), 100.0 * (found.damping / damping - 1.0)
    return *apart, found.joint == 2 and not found.rivals


def quiet_case(seed: int) -> bool:
    """Whether something was said to ring though nothing does."""
    scene = servo_scene(seed, moves=12, stand_s=1.2)
    found = ringing(scene.spots(), stands_of(scene.command()), lambda _: scene.lever_m, 0.06)
    return found.outcome is Outcome.FOUND


def slip_case(seed: int) -> tuple[bool, float, int]:
    """Found in its place, error of its size (rad), and slips that are none. Repeatability is 10 urad a stand."""
    scene = servo_scene(seed, moves=40)
    encoders, joints = scene.encoders(), scene.joints()
    stands = stands_of(scene.command())
    number = np.clip(np.searchsorted([s.from_s for s in stands], encoders.time_s), 1, len(stands)) - 1
    seated = scene.rng.normal(0.0, 1e-5, (len(stands), encoders.channels))[number]
    size, joint = scene.rng.uniform(6e-5, 3e-4) * scene.rng.choice([-1.0, 1.0]), int(scene.rng.integers(6))
    at_s = float(scene.rng.uniform(0.2, 0.8) * encoders.time_s[-1])
    slipped = np.zeros_like(seated)
    slipped[encoders.time_s > at_s, joint] = size
    found = slips(replace(encoders, values=encoders.values + seated + slipped), joints, stands).found
    true = [s for s in found if s.joint == joint + 1 and s.from_s - 2.0 <= at_s <= s.to_s + 2.0]
    return bool(true), abs(true[0].size_rad - size) if true else np.nan, len(found) - len(true[:1])


def settling_case(seed: int) -> tuple[int, int, int, int]:
    """Unsettled windows found, of how many; settled ones called unsettled, of how many."""
    scene = servo_scene(seed, frequency_hz=5.0, stand_s=0.8)
    stands, spots = stands_of(scene.command())[1:], scene.spots()
    early = scene.rng.random(len(stands)) < 0.3
    begin = np.where(early, 0.10, 0.55)
    windows = [Window(s.from_s + b, s.from_s + b + 0.05) for s, b in zip(stands, begin, strict=True)]
    said = np.array([one.outcome is Outcome.FOUND for one in unsettled(spots, windows, stands)])
    return int(said[early].sum()), int(early.sum()), int(said[~early].sum()), int((~early).sum())


def breaks_case(seed: int) -> tuple[bool, int]:
    """Four faults in one stream of encoders: all found at their samples, and how much else was said."""
    scene = servo_scene(seed)
    t = scene.times(100.0)
    q = np.round(scene.true(t) / ENCODER_RAD) * ENCODER_RAD
    sequence = np.arange(len(t))
    moving = np.flatnonzero(np.abs(np.gradient(q[:, 0], t)) > 0.05)
    frozen = int(scene.rng.choice(moving[(moving > 50) & (moving < len(t) // 3)]))
    q[frozen : frozen + 12] = q[frozen]
    keep = np.ones(len(t), dtype=bool)
    lost = int(scene.rng.integers(len(t) // 3 + 50, len(t) // 2))
    keep[lost : lost + 3] = False
    rows = np.insert(np.flatnonzero(keep), len(t) // 2 + 30, np.flatnonzero(keep)[len(t) // 2 + 29])
    stamps = t[rows].copy()
    back = int(scene.rng.integers(3 * len(t) // 4, len(t) - 50))
    stamps[back] = stamps[back - 1] - 0.5e-3
    found = breaks(Track("encoders", "rad", stamps, q[rows]), sequence[rows], scene.joints())
    by = {fault: [b for b in found if b.fault is fault] for fault in Fault}
    exact = (
        [b.samples for b in by[Fault.MISSED]] == [3]
        and len(by[Fault.DUPLICATED]) == 1
        and [b.last for b in by[Fault.BACKWARDS]] == [back]
        and any(abs(b.first - frozen) <= 1 for b in by[Fault.FROZEN])
    )
    return exact, len(found) - 4 if exact else 0


ENCODER_RAD = 2.0 * np.pi / 2**20


def _clock_line(name: str, results: list[tuple[float, float, float] | None]) -> str:
    good = np.array([r for r in results if r is not None]).reshape(-1, 3)
    return (
        f"{name}: found {len(good)}/{len(results)}; offset {_spread(list(1e3 * np.abs(good[:, 0])), 'ms')}; "
        f"drift {_spread(list(1e6 * np.abs(good[:, 1])), 'us/s')}; scatter in stated sigmas {np.std(good[:, 2]):.2f}"
    )


def _spread(errors: list[float], unit: str) -> str:
    return f"{np.median(errors):.2g} / {np.max(errors):.2g} {unit}" if errors else "-"
