"""A design as a person reads it in a terminal."""

from collections.abc import Sequence

import numpy as np

from acquisition.recording.rig import Rig
from calibeam.console import Console
from calibeam.printing.tables import plain_table
from calibeam.rig_files import of_one_point
from calibrate.design import Design, Places, Seen
from calibrate.diagnose.assess import Named, Smallest
from calibrate.quantities import counted, length
from calibrate.report.diagnosis import size_of
from calibrate.report.pose_design_page import of_the_curve

MATTERS_M = 1e-7  # of what no pose shows: below, the target does not feel it


def print_design(console: Console, rig: Rig, made: Design, seen: Seen, places: Sequence[Places]) -> None:
    """What the plan promises, how many poses are enough, places, causes."""
    for line in promise_lines(rig, made):
        console.print(line, markup=False, highlight=False)
    _print_curve(console, made)
    if places:
        _print_places(console, rig, made, places)
    _print_smallest(console, seen)
    _print_confusable(console, seen)


def promise_lines(rig: Rig, made: Design) -> list[str]:
    """Sentences."""
    order, information = made.in_time, made.information
    out = [
        f"{rig.name}: {len(made.taken.poses)} poses of {len(made.candidates)} candidates by criterion "
        f"{made.asked.criterion}",
        f"predicted error over the workspace ({information.target}): {length(made.free_space_m)} rms; as many random "
        f"poses: {length(made.random_m)} (ratio {made.free_space_m / made.random_m:.2f}); scale to "
        f"{1e6 * made.scale_sigma:.1f} ppm",
        f"of a steady drift geometry would absorb {100.0 * order.absorbed:.0f} % (in the order of shortest ways "
        f"{100.0 * order.absorbed_before:.0f} %); mean move {order.move_rad:.2f} rad ({order.move_before_rad:.2f})",
    ]
    if information.hidden_m > MATTERS_M:
        out.append(
            f"what none of these poses shows may still move the target by {length(information.hidden_m)} (assumed "
            "tolerances); "
            "it is not in these numbers"
        )
    if left_open := of_one_point(rig):
        out.append(left_open)
    return out


def _print_curve(console: Console, made: Design) -> None:
    curve = made.curve
    table = plain_table("predicted error by number of poses", "poses", "added one by one", "random")
    for i in np.unique(np.linspace(0, len(curve.poses) - 1, 8).astype(int)):
        table.add_row(str(curve.poses[i]), length(float(curve.chosen_m[i])), length(float(curve.random_m[i])))
    console.print(table)
    console.print(of_the_curve(made), markup=False, highlight=False)
    console.print(enough_line(made), markup=False, highlight=False)


def enough_line(made: Design) -> str:
    """From where on more poses are not worth their time."""
    if made.curve.enough is None:
        return f"up to {made.curve.poses[-1]} poses, more of them still show what fewer do not"
    return f"enough: {counted(made.curve.enough, 'pose')}; from there on more of them do little but average noise"


def _print_places(console: Console, rig: Rig, made: Design, places: Sequence[Places]) -> None:
    title = f"stations of the fixture, {made.asked.poses} poses shared out over them (numbers above the rig's: a grid)"
    table = plain_table(title, "stations", "error", "scale", "with distances", "scale", "distances needed")
    for one in places:
        table.add_row(
            ", ".join(map(str, one.ids)),
            length(one.free_space_m),
            f"{1e6 * one.scale_sigma:.1f} ppm",
            length(one.with_distances_m),
            f"{1e6 * one.with_distances_scale:.1f} ppm",
            "yes" if one.distances_needed else "no",
        )
    console.print(table)
    console.print("for each of them the rig file needs a [[placement]]:", highlight=False, markup=False)
    for line in placement_lines(rig, places[-1].ids):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def placement_lines(rig: Rig, ids: Sequence[int]) -> list[str]:
    """Rows of a rig file for those of the grid."""
    from calibeam.motion.reachable_poses import with_grid

    listed = with_grid(rig).placements
    out: list[str] = []
    for number in ids:
        if number not in rig.placements:
            pose = listed[number].psd1_in_base
            origin, turn = ([round(x, 6) for x in values] for values in (pose.origin_m, pose.rotation_rad))
            out.append(f"{number}: psd1_in_base = {{ origin_m = {origin}, rotation_rad = {turn} }}")
    return out


def _print_smallest(console: Console, seen: Seen) -> None:
    table = plain_table("causes that a diagnosis of this plan would find, from which size on", "cause", "at", "size")
    best: dict[str, Smallest] = {}
    for one in seen.smallest:
        kept = best.get(one.name.physics)
        if kept is None or (one.parameter == kept.parameter and one.value < kept.value):
            best[one.name.physics] = one
    for physics, one in sorted(best.items()):
        count = sum(other.name.physics == physics for other in seen.smallest)
        where = one.name.where if count == 1 else f"{one.name.where}, best of {count}"
        table.add_row(physics, where, size_of(one.parameter, one.value))
    console.print(table)


def _print_confusable(console: Console, seen: Seen) -> None:
    lines = [
        f"could not be separated: {name_of(a)} and {name_of(b)} (R2 {r2:.3f})"
        for a, b, r2 in sorted(seen.confusable_causes, key=lambda pair: pair[2])
    ]
    places: dict[str, dict[str, None]] = {}
    for one in seen.invisible:
        places.setdefault(one.physics, {})[one.where] = None
    lines += [f"not shown, or not in every form: {physics} at {', '.join(at)}" for physics, at in places.items()]
    for line in lines or ["all causes of the catalogue can be separated"]:
        console.print(line, markup=False, highlight=False)


def name_of(name: Named) -> str:
    """Physics, place and what it depends on."""
    order = "" if name.order is None else f", order {name.order}"
    return f"{name.physics} at {name.where} ({', '.join(name.depends_on)}{order})"
