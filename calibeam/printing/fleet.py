"""A run over a fleet as a person reads it in a terminal, and as a script reads it."""

from typing import Any

import msgspec
from rich.table import Table

from calibeam.console import Console
from calibeam.fleet.run import RunResult
from calibeam.fleet.summary import Fleet, drift_words, shared_words
from calibrate.quantities import counted, length

SHOWN = 20  # lines of a kind; the page holds more


def print_fleet(console: Console, ran: RunResult, fleet: Fleet) -> None:
    """Counts, the robots as they are now, what drifts, what is shared, what failed."""
    table = Table()
    for heading in ("robot", "recordings", "last", "unseen rows", "trust", "diagnosis"):
        table.add_column(heading, justify="right" if heading in ("recordings", "unseen rows") else "left")
    for row in fleet.newest()[:SHOWN]:
        count = sum(other.robot == row.robot for other in fleet.good)
        unseen = "-" if row.held_out_after_m is None else length(row.held_out_after_m)
        table.add_row(row.robot, str(count), row.started_utc[:10] or "-", unseen, row.trust, row.verdict or "-")
    console.print(table)
    if len(fleet.robots) > SHOWN:
        console.print(f"and {counted(len(fleet.robots) - SHOWN, 'more robot')}")
    lines = [drift_words(drift) for drift in fleet.drifting] + [f"shared: {shared_words(c)}" for c in fleet.shared]
    if not fleet.drifting:
        untested = "drift is not determined: no zero was determined on three dates"
        lines.insert(0, f"no zero drifts significantly ({len(fleet.lines)} tested)" if fleet.lines else untested)
    lines += [f"{row.outcome.value}: {row.name}: {row.error}" for row in fleet.bad[:SHOWN]]
    if len(fleet.bad) > SHOWN:
        lines.append(f"and {len(fleet.bad) - SHOWN} more failed")
    for line in lines:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(_counts(ran, fleet), markup=False, highlight=False)


def _counts(ran: RunResult, fleet: Fleet) -> str:
    said = f"{counted(len(fleet.rows), 'recording')}: {len(fleet.good)} identified"
    said += f" ({len(fleet.torn)} of them cut short or damaged)" if fleet.torn else ""
    said += f", {len(fleet.bad)} failed or lost"
    said += f", {len(fleet.empty)} without samples" if fleet.empty else ""
    said += f"; {ran.stood} unchanged since an earlier run" if ran.stood else ""
    return said + (f"; {ran.kept} only in the table: no such file in this folder" if ran.kept else "")


def fleet_record(ran: RunResult, fleet: Fleet, table: str, page: str) -> dict[str, Any]:
    """What `--json` prints."""
    return {
        "schema": 1,
        "kind": "calibeam-fleet",
        "table": table,
        "page": page,
        "recordings": len(fleet.rows),
        "identified": len(fleet.good),
        "torn": [row.name for row in fleet.torn],
        "empty": len(fleet.empty),
        "failed": [{"name": r.name, "outcome": r.outcome.value, "error": r.error} for r in fleet.bad],
        "stood": ran.stood,
        "left": ran.left,
        "stopped": bool(ran.stopped),
        "robots": list(fleet.robots),
        "tested": len(fleet.lines),
        "scatter": fleet.drifts.scatter,
        "drifts": [
            {
                "robot": d.series.robot,
                "joint": d.series.joint,
                "dates": d.series.dates,
                "slope_rad_year": d.slope_rad_year,
                "sigma_rad_year": d.sigma_rad_year,
                "low_rad_year": d.low_rad_year,
                "high_rad_year": d.high_rad_year,
                "p": d.p,
            }
            for d in fleet.drifting
        ],
        "shared": [msgspec.to_builtins(c) for c in fleet.shared],
    }
