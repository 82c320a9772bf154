"""A pose test to ISO 9283 on the terminal: the largest figures first, then a line a pose."""

import math
from collections.abc import Callable, Sequence

from rich.table import Table

from calibeam.console import Console
from calibrate.iso9283 import CYCLES, DistancePerformance, EvaluatedTest, Performance, PosePerformance, PoseTest
from calibrate.model.effects.term import with_sigma

MM, MRAD = 1e3, 1e3
DASH = "–"
FRAMES = {
    "fit": "pose of the device: best fit of all poses; an error that is the same in all poses is not included",
    "model": "pose of the device: as identified in the model's session",
    "device": "as measured: repeatability does not depend on the pose of the device",
    "rig": "pose of the device: [device] of the rig file, assumed to be exact",
}


def print_pose_test(console: Console, found: EvaluatedTest, written: str) -> None:
    """What was measured, what the model predicts of it, and what its correction leaves."""

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    if not found.measured.poses:
        say(f"no pose was attained twice in {found.rows} rows with a position: repeatability needs cycles")
    else:
        say(_largest("measured", found.measured.poses))
        if found.corrected is not None:
            say(_largest("with the model's correction", found.corrected.poses))
        console.print(_poses(found))
    for name, test in (("", found.measured), (", corrected", found.corrected)):
        for line in _others(test) if test is not None else ():
            say(line.format(name))
    few = [one.pose for one in found.measured.poses if one.cycles < CYCLES]
    if few:
        say(f"the standard requires {CYCLES} cycles; there are fewer of P{', P'.join(map(str, few))}")
    say(FRAMES[found.frame])
    for note in found.notes:
        say(note)
    say(written)


def millimetres(one: Performance | None) -> str:
    """Value and one sigma."""
    return DASH if one is None or math.isnan(one.value) else _millimetres(one.value, one.sigma)


def _millimetres(value_m: float, sigma_m: float) -> str:
    return with_sigma(MM * value_m, MM * sigma_m)


def _largest(what: str, poses: Sequence[PosePerformance]) -> str:
    """The figures that a data sheet states: the worst pose."""

    def worst(of: Callable[[PosePerformance], Performance | None]) -> str:
        values = [
            (figure, one.pose) for one in poses if (figure := of(one)) is not None and not math.isnan(figure.value)
        ]
        if not values:
            return ""
        figure, pose = max(values, key=lambda pair: pair[0].value)
        return f"{millimetres(figure)} mm (P{pose})"

    parts = (
        ("AP", worst(lambda one: one.accuracy_m)),
        ("RP", worst(lambda one: one.repeatability_m)),
        ("vAP", worst(lambda one: one.variation_m)),
    )
    return f"{what}: " + ", ".join(f"{symbol} {text}" for symbol, text in parts if text) + ", largest of all poses"


def _poses(found: EvaluatedTest) -> Table:
    """mm; RP with the correction is that of the measured test but for conditions that change: it is in the file."""
    poses = found.measured.poses
    columns: list[tuple[str, list[str]]] = [
        ("", [f"P{one.pose}" for one in poses]),
        ("n", [str(one.cycles) for one in poses]),
        ("AP, mm", [millimetres(one.accuracy_m) for one in poses]),
    ]
    if found.corrected is not None:
        better = {one.pose: one.accuracy_m for one in found.corrected.poses}
        columns.append(("predicted", [_millimetres(*found.predicted_m[one.pose]) for one in poses]))
        columns.append(("corrected", [millimetres(better[one.pose]) for one in poses]))
    columns.append(("RP, mm", [millimetres(one.repeatability_m) for one in poses]))
    if any(one.variation_m is not None for one in poses):
        columns.append(("vAP, mm", [millimetres(one.variation_m) for one in poses]))
    if any(one.turn_rad for one in poses):
        columns.append(("AP about x, y, z, mrad", [_angles(one.turn_rad) for one in poses]))
        columns.append(("RP about them, ± mrad", [_angles(one.turn_repeatability_rad) for one in poses]))
    table = Table(*(name for name, _ in columns), padding=(0, 0))
    for row in zip(*(cells for _, cells in columns), strict=True):
        table.add_row(*row)
    return table


def _angles(each: Sequence[Performance]) -> str:
    return ", ".join(f"{MRAD * one.value:.3f}" for one in each)


def _others(test: PoseTest) -> list[str]:
    """Distances and drift; {} stands for which of both tests it is."""
    out: list[str] = []
    if test.distance is not None:
        out.append(_distance(test.distance))
    if (drift := test.drift) is not None:
        out.append(
            f"drift of P{drift.pose}{{}} over {drift.after_s[-1] / 3600.0:.2f} h, {len(drift.after_s)} sets: dAP "
            f"{millimetres(drift.dap_m)} mm, dRP {millimetres(drift.drp_m)} mm; barycentre moved by at most "
            f"{millimetres(drift.moved_m)} mm"
        )
    return out


def _distance(one: DistancePerformance) -> str:
    command = "" if math.isnan(one.command_m) else f" {MM * one.command_m:.3f} mm,"
    return (
        f"distance P{one.poses[0]} to P{one.poses[1]}{{}},{command} {one.cycles} cycles: "
        f"AD {millimetres(one.accuracy_m)} mm, RD ± {millimetres(one.repeatability_m)} mm"
    )
