"""errors.json: an error simulation for scripts, version 1. docs/error-simulation.md explains every key."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from calibrate.error_simulation.simulate import Simulation
from calibrate.errors import DataError

SHARE = 0.95


def record_of(simulation: Simulation, software: str) -> dict[str, Any]:
    """Plain numbers, SI; names end in their unit."""
    s = simulation
    return {
        "schema": 1,
        "kind": "calibeam-errors",
        "software": software,
        "arm": s.machine.name,
        "seed": s.asked.seed,
        "arms": s.drawn.arms,
        "workspace": {
            "poses": len(s.wide_rad),
            "rms_m": float(np.sqrt(np.mean(s.wide.rms_m**2))),
            "max_m": float(s.wide.rms_m.max()),
        },
        "poses": [_pose(s, i) for i in range(len(s.drawn_at_rad))],
        "sobol_poses": s.shares.poses,
        "budget": [
            {"group": line.group, "sources": line.sources, "rms_m": line.rms_m, "share": line.share}
            for line in s.budget
        ],
        "sources": [_source(s, int(i)) for i in s.ranking],
        "worst": [{"q_rad": p.q_rad.tolist(), "probe_m": p.probe_m.tolist(), "rms_m": p.rms_m} for p in s.worst],
    }


def write_record(path: Path, simulation: Simulation, software: str) -> None:
    """Over what may be there. DataError where it cannot be written."""
    try:
        path.write_bytes(msgspec.json.format(msgspec.json.encode(record_of(simulation, software)), indent=1) + b"\n")
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error.strerror}); choose another --out") from error


def _pose(s: Simulation, i: int) -> dict[str, Any]:
    return {
        "q_rad": s.drawn_at_rad[i].tolist(),
        "linear_rms_m": float(s.linear.rms_m[i]),
        "linear_sigma_m": s.linear.sigma_m[i].tolist(),
        "drawn_rms_m": float(s.drawn.rms_m[i]),
        "drawn_sigma_m": s.drawn.sigma_m[i].tolist(),
        "drawn_bias_m": s.drawn.mean_m[i].tolist(),
        "drawn_p95_m": float(s.drawn.quantile_m(SHARE)[i]),
        "drawn_max_m": float(s.drawn.worst_m[i]),
        "worst_arm": int(s.drawn.worst_arm[i]),
    }


def _source(s: Simulation, i: int) -> dict[str, Any]:
    source, single = s.sources[i], s.singles[i]
    return {
        "name": source.name,
        "group": source.group,
        "unit": source.unit,
        "law": source.law.name,
        "loc": source.law.loc,
        "scale": source.law.scale,
        "alone_rms_m": float(s.wide.alone_m[i]),
        "gain_m_per_unit": single.gain,
        "share_linear": float(s.wide.shares[i]),
        "share_first": float(s.shares.first[i]),
        "share_first_sigma": float(s.shares.first_sigma[i]),
        "share_total": float(s.shares.total[i]),
        "share_total_sigma": float(s.shares.total_sigma[i]),
    }
