"""A real arm calibrated by pairs of sockets: the figures on a place of the pair that the fit has not seen.

No truth is known but the distance of the two sockets. Of the place left out: how far the ball is from the mean of its
socket, and how far apart the two means are. `places` are the folders of the recording, one file a socket in each.
"""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples, read
from acquisition.recording.foreign import columns_file, read_seats, samples_of, understand, write_session
from acquisition.recording.samples import SEAT
from calibeam.new_rig.drawn import poe_text
from calibeam.new_rig.from_urdf import urdf_arm
from calibeam.results.identification import identify_session, session_model
from calibrate.apply.predicting import predict_with_physics
from calibrate.diagnose.assess.diagnosis import Finding
from calibrate.diagnose.from_recording import diagnose_samples
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.model_file import ModelFile
from calibrate.model.parameters import start_values
from calibrate.model.sensors.seat import TIP

APART_M, SIGMA_M = 0.05, 0.03e-3  # of the two sockets: as drawn, and what a caliper resolves (DIN 862: 0.03 mm)
FIRST_REFITTED, REFITTED_M = 9, np.array([1e-3, 0.0, 0.0])  # the fifth of eight places
HEAD = "| left out | rows | from the mean of the socket | distance of the sockets less 50 mm |"
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """Of one place of the pair of sockets by one model, in metres."""

    from_mean_m: Floats  # (row,) distance of the ball from the mean of its socket
    length_error_m: float  # distance of the two means, less the one that is known


def session_of(folder: Path, out: Path) -> Recording:
    """The folder of the real recording as a session: seats 1 and 2 are the first place, 3 and 4 the second, ..."""
    files = sorted(folder.glob("placements/*/hole_?.csv"))
    known = (
        f'\n[[known_distance]]\nof = "seat"\nfrom = {k}\nto = {k + 1}\nlength_m = {APART_M}\nsigma_m = {SIGMA_M}\n'
        for k in range(1, len(files), 2)
    )
    text = poe_text(urdf_arm(folder / "panda.urdf", None, "ball_link")) + "".join(known)
    table = understand(read_seats(files, None, 0), text, "rig.toml", "1..7 [rad] = q")
    samples = samples_of(table)
    write_session(table, samples, columns_file(table, samples, "benchmark"), out)
    return read(out)


def model_without(recording: Recording, place: int | None) -> tuple[ModelFile, Samples]:
    """The model of all rows but those of one place (from 0; None: all rows), and the rows that it has not seen."""
    at = (recording.samples.integers(SEAT, 0) - 1) // 2
    known = replace(recording, samples=recording.samples.take(np.flatnonzero(at != place)))
    return session_model(identify_session(known), known), recording.samples.take(np.flatnonzero(at == place))


def pairs_of(model: ModelFile, samples: Samples) -> Mapping[int, Pair]:
    """Of every place (from 0) in these rows."""
    columns = predict_with_physics(model, samples, same_session=False).columns
    tip_m = np.stack([columns[name] for name in TIP], axis=1)
    return pairs_at(tip_m, samples.integers(SEAT, 0))


def pairs_at(tip_m: Floats, seat: NDArray[np.int64]) -> Mapping[int, Pair]:
    """The same of the ball's centre in the base (row, 3), for the seat of each row (row,)."""
    mean_m = {k: tip_m[seat == k].mean(axis=0) for k in np.unique(seat).tolist()}
    away_m = np.linalg.norm(tip_m - np.array([mean_m[k] for k in seat.tolist()]), axis=1)
    return {
        (k - 1) // 2: Pair(
            away_m[(seat == k) | (seat == k + 1)], float(np.linalg.norm(mean_m[k + 1] - mean_m[k])) - APART_M
        )
        for k in mean_m
        if k % 2
    }


def nominal_pairs(recording: Recording) -> Mapping[int, Pair]:
    """Of every place by the arm and the ball as drawn: the ball is the end of the arm."""
    arm = arm_of(recording.rig)
    tip_m = arm.flange(start_values(arm.parameters), recording.samples.joints())[:, :3, 3]
    return pairs_at(tip_m, recording.samples.integers(SEAT, 0))


def left_out(recording: Recording) -> Iterator[Pair]:
    """Each place in turn by the model of all the others."""
    for place in range(int(recording.samples.integers(SEAT, 0).max()) // 2):
        model, unseen = model_without(recording, place)
        yield pairs_of(model, unseen)[place]


def refitted(recording: Recording, first_seat: int, shift_m: Floats) -> Recording:
    """As if the ball had been fixed again, by a shift (3,) in the flange, before the first row of a seat: from there on
    the least change of the joint angles that leaves the ball where it was. The rest of each row's misfit stays.
    """
    arm, samples = arm_of(recording.rig), recording.samples
    theta, q_rad = start_values(arm.parameters), samples.joints().copy()
    late = np.flatnonzero(samples.integers(SEAT, 0) >= first_seat)
    T = arm.flange(theta, q_rad[late])
    tip = arm.joint_twists(theta, q_rad[late])  # of the flange about the base: [v; w]
    by_joint = tip[:, :3] + np.cross(tip[:, 3:], T[:, :3, 3][:, :, None], axis=1)
    q_rad[late] -= np.einsum("njk,nk->nj", np.linalg.pinv(by_joint), T[:, :3, :3] @ shift_m)
    columns = {f"q{j + 1}_rad": q_rad[:, j] for j in range(samples.n_joints)}
    return replace(recording, samples=Samples({**samples.columns, **columns}, samples.n_joints))


def found_again(recording: Recording, first_seat: int, shift_m: Floats) -> list[Finding]:
    """What a diagnosis names as a moved tool where the ball was fixed again."""
    changed = refitted(recording, first_seat, shift_m)
    found = diagnose_samples(changed.rig, changed.samples, np.random.default_rng(1))
    if found.physics is None:
        return []
    return [f for f in found.physics.diagnosis.findings if f.name.physics == "tool-moved"]


def lines(folder: Path) -> Iterator[str]:
    """A line a place, and the means; one line that says so where the recording is not there."""
    if not folder.is_dir():
        yield f"skipped: no folder {folder.name}; the real recordings are not part of the project"
        return
    names = sorted(path.name for path in (folder / "placements").iterdir())
    with tempfile.TemporaryDirectory() as work:
        recording = session_of(folder, Path(work) / "session")
        yield HEAD
        yield "|" + "---|" * (HEAD.count("|") - 1)
        yield _line("nominal arm", list(nominal_pairs(recording).values()))
        found: list[Pair] = []
        for name, pair in zip(names, left_out(recording), strict=True):
            found.append(pair)
            yield _line(name, [pair])
        yield _line("mean of all", found)
        model, _ = model_without(recording, None)
        whole = list(pairs_of(model, recording.samples).values())
        yield _line("none", whole)
        again = found_again(recording, FIRST_REFITTED, REFITTED_M)
        yield f"ball shifted by 1 mm from seat {FIRST_REFITTED} on: " + (
            "; ".join(f.says for f in again) or "not named"
        )
    for what, some in (("left out", found), ("none left out", whole)):
        scale = np.array([pair.length_error_m for pair in some]) / APART_M
        sigma = scale.std(ddof=1) / np.sqrt(len(scale))
        yield f"scale of the arm, {what}: {100 * scale.mean():+.2f} ± {100 * sigma:.2f} %"


def _line(name: str, pairs: list[Pair]) -> str:
    away_m = np.concatenate([pair.from_mean_m for pair in pairs])
    errors_m = np.array([pair.length_error_m for pair in pairs])
    length = (
        f"{1e3 * errors_m[0]:+.3f} mm" if len(pairs) == 1 else f"{1e3 * np.abs(errors_m).mean():.3f} mm (mean size)"
    )
    return f"| {name} | {len(away_m)} | {1e3 * away_m.mean():.3f} mm | {length} |"
