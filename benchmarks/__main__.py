"""`make bench`: every benchmark, or those named: `python -m benchmarks centring zeros`; some in slices (slices.py)."""

import math
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from acquisition.recording.rig import load_rig, plain_rig, rig_text
from benchmarks import (
    can_frames,
    centring,
    centring_plot,
    centring_wires,
    coarse_aim,
    coverage,
    damaged,
    designed_poses,
    device_faults,
    diagnosis_speed,
    error_simulation,
    false_alarms,
    fleet,
    gross_errors,
    inverse,
    killed,
    live,
    live_endured,
    live_picture,
    log_cost,
    measuring_arm,
    motion,
    motion_cost,
    motion_rivals,
    panda_motion,
    plan_taken,
    proof_comparison,
    proof_misses,
    real_diagnosis,
    rtde_jitter,
    slices,
    sockets,
    speed,
    stops,
    streams,
    wired_streams,
    with_known_model,
    zeros,
)

RIG = Path(__file__).parents[1] / "rigs" / "ur5e-dual-psd.toml"
ARM_RIG = RIG.with_name("arm-cmm-reference.toml")
CAMERA_RIG = RIG.with_name("ur5e-dual-psd-camera.toml")


def run_centring_cold() -> None:
    rig, plain = load_rig(RIG), plain_rig(rig_text(RIG), str(RIG))
    cold = (centring.SESSIONS,)
    print("centring from 500 random cold starts, fixture pose wrong by up to 90 deg and 50 mm, orders alternating")
    print("\n".join(centring.lines(centring.run(rig, plain, range(500), 21_000, cold, math.radians(90.0)))))
    print("from 200, wrong by up to 45 deg")
    print("\n".join(centring.lines(centring.run(rig, plain, range(200), 22_000, cold, math.radians(45.0)))))


def run_centring() -> None:
    rig, plain = load_rig(RIG), plain_rig(rig_text(RIG), str(RIG))
    print("centring from 100 random starts, fixture pose wrong by up to 80 deg and 50 mm, orders alternating")
    runs = centring.run(rig, plain)
    print("\n".join(centring.lines(runs)))
    centring_plot.write_plot(RIG.parents[1] / "docs" / "figures" / "centring.svg", runs)
    print("steps to 5 um drawn in docs/figures/centring.svg")
    print("\n".join(centring.search_lines(centring.run_search(rig, plain))))


def run_centring_wires() -> None:
    print("centring on wires at 500 Hz, real time; needs a quiet machine")
    for row in centring_wires.lines(RIG):
        print(row, flush=True)


def run_coarse_aim() -> None:
    print("coarse aim by camera, 200 random starts with the board in view, 50 worlds, orders alternating")
    for row in coarse_aim.lines(CAMERA_RIG):
        print(row, flush=True)


def run_zeros() -> None:
    rig, text = load_rig(RIG), rig_text(RIG)
    print("joint zeros of 20 concealed truths, deviation from the truth in stated sigmas")
    results: list[zeros.SeedResult] = []
    for result in zeros.run(rig, plain_rig(text, str(RIG)), text, range(1, 21)):
        results.append(result)
        print(zeros.line(result), flush=True)
    print(zeros.summary_line(results))


def run_coverage() -> None:
    print("95 % intervals over 1,000 sessions of concealed truths, tracker and dual PSD in turn")
    print("\n".join(coverage.lines(coverage.run(RIG))))


def run_with_known_model(seeds: range | None = None) -> None:
    print("beside a known model: its own recording, an unchanged later one, and one after a change drawn at random")
    for row in with_known_model.lines(seeds or range(with_known_model.FIRST_SEED, with_known_model.FIRST_SEED + 10)):
        print(row, flush=True)


def run_gross_errors() -> None:
    print("blunders put into sessions at random rows and joints, and healthy sessions of every instrument")
    for row in gross_errors.lines(RIG, RIG.parents[2] / "shared" / "data"):
        print(row, flush=True)


def run_streams() -> None:
    for row in streams.lines(RIG):
        print(row, flush=True)


def run_speed() -> None:
    for row in speed.lines(RIG):
        print(row, flush=True)


def run_real() -> None:
    print("real recordings: unseen blocks by the model files of identify and diagnose")
    for row in real_diagnosis.lines(RIG.parents[2] / "shared" / "data"):
        print(row, flush=True)


def run_motion() -> None:
    print("torques of a real robot in motion: learned from record A, proved on record B, which no fit has seen")
    for row in motion.lines(RIG.parents[2] / "shared" / "data" / "kr300-encoders"):
        print(row)


def run_motion_cost() -> None:
    for row in motion_cost.lines():
        print(row)


def run_panda_motion() -> None:
    print("torques of a real 7-axis robot: learned from the first 70 % of a motion, proved on the rest")
    for row in panda_motion.lines(Path(os.environ.get("PANDA_MOTION", "rbt_log"))):
        print(row)


def run_motion_rivals() -> None:
    print("cases of a finished proof of motions: other methods on the same moments, judged on the unseen end")
    for row in motion_rivals.lines(Path(os.environ.get("PROOF_MOTION", RIG.parents[1] / "out" / "proof-motion"))):
        print(row, flush=True)


def run_sockets() -> None:
    print("a real arm calibrated by pairs of sockets, without a measuring device: places that the fit has not seen")
    for row in sockets.lines(RIG.parents[2] / "shared" / "data" / "panda-sockets"):
        print(row, flush=True)


def run_proof() -> None:
    print("the cases of the last `make prove`: an oracle and other methods, and every fault of the diagnosis")
    folder = RIG.parents[1] / "out" / "proof"
    if not folder.is_dir():
        print("no proof in out/proof; make one with `make prove`")
        return
    proof_comparison.main(folder)
    proof_misses.main(folder)


def run_diagnosis_speed() -> None:
    print("cost of a diagnosis: drawn sessions, growth by rows, the real recordings")
    for row in diagnosis_speed.lines(RIG.parents[2] / "shared" / "data"):
        print(row, flush=True)


def run_plan_taken() -> None:
    print("a plan of the poses that tell rivals apart, taken on the emulated world: BIC between them before and after")
    with tempfile.TemporaryDirectory() as folder:
        for row in plan_taken.lines(RIG, Path(folder), range(61, 67)):
            print(row, flush=True)


def run_designed_poses(seeds: range | None = None) -> None:
    print("60 designed poses beside 60 random ones on the emulated rig: true error of the beam in free space")
    for row in designed_poses.lines(RIG, seeds or range(1, 21), anew=seeds is None):
        print(row, flush=True)


def run_errors() -> None:
    print("a million perturbed arms")
    for row in error_simulation.lines(RIG.parent):
        print(row, flush=True)


def run_wired_streams() -> None:
    print("sessions over real wires with devices in trouble; needs a quiet machine")
    for row in wired_streams.lines(RIG):
        print(row, flush=True)


def run_false_alarms() -> None:
    print("sessions with nothing hidden, five kinds in turn, as many of each noise: share in which something is found")
    for row in false_alarms.lines():
        print(row, flush=True)


def run_fleet() -> None:
    print("a fleet of emulated robots: time of `calibeam batch` over files, workers, engines")
    with tempfile.TemporaryDirectory() as folder:
        for row in fleet.lines(Path(folder)):
            print(row, flush=True)


def run_fleet_drift() -> None:
    print("fleets in which nothing drifts, or one zero does: what is said")
    for row in (*fleet.false_drift_lines(), *fleet.found_drift_lines()):
        print(row, flush=True)


def run_inverse() -> None:
    print("inverse kinematics in batch")
    for row in inverse.lines(RIG):
        print(row, flush=True)


def run_faults() -> None:
    print("13 fault kinds at 4 devices in 5 phases: each must end in a defined state within 2 s")
    for row in device_faults.lines():
        print(row, flush=True)


def run_stops() -> None:
    print("what stops a session, and how fast: event x state, by the controller's own time stamps")
    for row in stops.lines(RIG):
        print(row, flush=True)


def run_live() -> None:
    print("the live page's own thread, devices at 1000, 500 and 100 Hz")
    print("\n".join(cost.line for cost in live.run(load_rig(RIG))))


def run_live_endured() -> None:
    print(f"a live page open for {live_endured.MINUTES:g} min: {live_endured.watched(load_rig(RIG)).line}")


def run_live_picture() -> None:
    path = RIG.parents[1] / "docs" / "figures" / "live.png"
    live_picture.write_picture(load_rig(RIG), path)
    print(f"drawn in {path}")


def run_rtde() -> None:
    print("RTDE at 500 Hz into a recording for ten minutes")
    print("\n".join(rtde_jitter.lines(RIG, 600.0, RIG.parents[1] / "out" / "rtde")))


def run_rtde_minute() -> None:
    print("RTDE at 500 Hz into a recording for one minute")
    print("\n".join(rtde_jitter.lines(RIG, 60.0, RIG.parents[1] / "out" / "rtde-minute")))


def run_recording() -> None:
    print("a recording killed, cut, damaged; CAN frames through it")
    for module in (killed, damaged, can_frames):
        for row in module.lines(RIG):
            print(row, flush=True)


def run_log_cost() -> None:
    print("`calibeam log encoders`: six encoders at 1 kHz, positions and every frame")
    for row in log_cost.lines(RIG):
        print(row, flush=True)


def run_measuring_arm(seeds: range | None = None) -> None:
    print(
        "a measuring arm from cones and bars by an emulated hand, judged on fresh readings against its encoders' noise"
    )
    asked, anew = seeds or range(1, 13), seeds is None
    for row in measuring_arm.lines(ARM_RIG, asked, "measuring-arm", anew=anew):
        print(row, flush=True)


def run_perfect_bearings(seeds: range | None = None) -> None:
    print("the same arms with perfect bearings: axes that neither lean nor run out")
    asked, anew, perfect = seeds or range(1, 4), seeds is None, measuring_arm.PERFECT_BEARINGS
    for row in measuring_arm.lines(ARM_RIG, asked, "measuring-arm-bearings", anew=anew, **perfect):
        print(row, flush=True)


BENCHMARKS: dict[str, Callable[[], None]] = {
    "centring": run_centring,
    "centring_cold": run_centring_cold,
    "centring_wires": run_centring_wires,
    "coarse_aim": run_coarse_aim,
    "inverse": run_inverse,
    "zeros": run_zeros,
    "coverage": run_coverage,
    "beside_model": run_with_known_model,
    "blunders": run_gross_errors,
    "speed": run_speed,
    "false_alarms": run_false_alarms,
    "fleet": run_fleet,
    "fleet_drift": run_fleet_drift,
    "streams": run_streams,
    "wired_streams": run_wired_streams,
    "plan_taken": run_plan_taken,
    "errors": run_errors,
    "designed_poses": run_designed_poses,
    "real": run_real,
    "motion": run_motion,
    "motion_cost": run_motion_cost,
    "panda_motion": run_panda_motion,
    "motion_rivals": run_motion_rivals,
    "sockets": run_sockets,
    "proof": run_proof,
    "diagnosis_speed": run_diagnosis_speed,
    "measuring-arm": run_measuring_arm,
    "measuring-arm-bearings": run_perfect_bearings,
    "recording": run_recording,
    "log_cost": run_log_cost,
    "faults": run_faults,
    "stops": run_stops,
    "live": run_live,
    "live_endured": run_live_endured,
    "live_picture": run_live_picture,
    "rtde": run_rtde,
    "rtde-minute": run_rtde_minute,
}


SEEDED: dict[str, Callable[[range], None]] = {
    "beside_model": run_with_known_model,
    "designed_poses": run_designed_poses,
    "measuring-arm": run_measuring_arm,
    "measuring-arm-bearings": run_perfect_bearings,
}


def main(words: list[str]) -> int:
    try:
        names, seeds = slices.asked(words)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"no benchmark named {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    if seeds is not None and not (names and set(names) <= set(SEEDED)):
        print(f"--seeds belongs to {', '.join(SEEDED)}", file=sys.stderr)
        return 2
    for name in names or BENCHMARKS:
        print(f"--- {name}")
        if seeds is not None:
            SEEDED[name](seeds)
        else:
            BENCHMARKS[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
