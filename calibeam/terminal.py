"""Identified zeros as a person reads them in a terminal: rank first, then numbers, each with its doubt."""

import numpy as np
from rich.console import Console
from rich.table import Table

from acquisition.recording.rig_schema import Rig
from calibeam.evidence_lines import told_lines
from calibeam.identification import Identified
from calibeam.reveal import Revealed
from calibeam.verdict_line import print_verdict
from calibrate.default_belief import said_of
from calibrate.identifiability import Identifiability
from calibrate.report.evidence import evidence
from calibrate.report.verdict import verdict
from calibrate.zeros.point_constraint import PointConstraintResult
from calibrate.zeros.result import JointZero, ZeroResult


def print_identified(console: Console, identified: Identified) -> None:
    """What was wrong with the file, the full model, the source's method beside it, and last how far to trust it."""
    print_unasked(console, identified.used.rig)
    for blunder in identified.blunders:
        console.print(f"left out: {blunder.says}", highlight=False, markup=False)
    _print_full(console, identified.zeros)
    for line in [] if identified.proved is None else told_lines(identified.proved):
        console.print(line, highlight=False, markup=False)
    if identified.four_poses is not None:
        _print_four_poses(console, identified.four_poses)
    print_verdict(console, verdict(evidence(identified.used, identified.zeros, "reported")))


def print_unasked(console: Console, rig: Rig) -> None:
    """What a fit to spots believes of a rig that states no tolerance."""
    if (said := said_of(rig)) is not None:
        console.print(said, highlight=False, markup=False)


def print_revealed(console: Console, revealed: tuple[Revealed, ...]) -> None:
    """What was said beside what is true."""
    table = Table(title="concealed truth, opened after the fit", title_justify="left")
    for heading in ("joint", "identified (deg)", "sigma", "truth (deg)", "off by", "in sigma"):
        table.add_column(heading, justify="right")
    for one in revealed:
        if one.value_rad is None or one.sigma_rad is None or one.deviation is None:
            table.add_row(f"J{one.joint}", "-", "-", f"{np.degrees(one.truth_rad):+.5f}", "-", "not said")
            continue
        off_rad = one.value_rad - one.truth_rad
        table.add_row(
            f"J{one.joint}",
            f"{np.degrees(one.value_rad):+.5f}",
            f"{np.degrees(one.sigma_rad):.5f}",
            f"{np.degrees(one.truth_rad):+.5f}",
            f"{np.degrees(off_rad):+.5f}",
            f"{one.deviation:+.2f}",
        )
    console.print(table)


def _print_four_poses(console: Console, result: PointConstraintResult) -> None:
    console.print("\n[bold]for comparison (source method)[/bold]: four-pose point constraint, Deng, Ding, Zhang 2019")
    _print_rank(console, result.identifiability)
    _print_zeros(console, result.zeros)


def _print_full(console: Console, result: ZeroResult) -> None:
    console.print(f"\n[bold]full dual-PSD model[/bold], {result.n_poses} poses")
    _print_rank(console, result.identifiability)
    _print_zeros(console, result.zeros)
    noise = result.noise
    console.print(
        f"spots explained: {1e6 * result.rms_before_m:.1f} um before, {1e6 * result.rms_after_m:.2f} um after; "
        f"noise found: joints {1e6 * noise.joint_rad:.2f} urad (believed {1e6 * noise.joint_believed_rad:.2f}), "
        f"spots {1e6 * noise.psd_m:.2f} um (believed {1e6 * noise.psd_believed_m:.2f})"
    )
    if result.held_out is not None:
        held = result.held_out
        console.print(
            f"held out ({held.split}): {held.poses} poses, {1e6 * held.rms_before_m:.1f} um before, "
            f"{1e6 * held.rms_after_m:.2f} um after"
        )


def _print_rank(console: Console, seen: Identifiability) -> None:
    console.print(f"rank {seen.rank} of {seen.n_free} unknowns, condition {seen.condition:.3g}")
    console.print("singular values: " + " ".join(f"{v:.2g}" for v in seen.singular_values), highlight=False)


def _print_zeros(console: Console, zeros: tuple[JointZero, ...]) -> None:
    table = Table()
    for heading in ("joint", "zero (deg)", "sigma (deg)", "sigma (urad)", "measurement alone (urad)"):
        table.add_column(heading, justify="right")
    for zero in zeros:
        if zero.value_rad is None or zero.sigma_rad is None:
            table.add_row(f"J{zero.joint}", "not determined", "-", "-", "-")
            continue
        alone = "-" if zero.measurement_sigma_rad is None else f"{1e6 * zero.measurement_sigma_rad:.1f}"
        table.add_row(
            f"J{zero.joint}",
            f"{np.degrees(zero.value_rad):+.5f}",
            f"{np.degrees(zero.sigma_rad):.5f}",
            f"{1e6 * zero.sigma_rad:.1f}",
            alone,
        )
    console.print(table)
    for zero in zeros:
        if zero.value_rad is None:
            console.print(f"  J{zero.joint} not determined: {zero.why}", highlight=False)
