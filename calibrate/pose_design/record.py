"""A design for scripts, version 1: docs/design-of-poses.md explains every key. SI, units in the names."""

from collections.abc import Sequence
from typing import Any

from acquisition.recording.rig import Rig
from calibrate.diagnose.diagnosis import Named
from calibrate.pose_design.design import Design
from calibrate.pose_design.places import Places
from calibrate.pose_design.seen import Seen


def record_of(rig: Rig, made: Design, seen: Seen, places: Sequence[Places], software: str) -> dict[str, Any]:
    """Plain numbers and names."""
    return {
        "schema": 1,
        "kind": "calibeam-design",
        "software": software,
        "rig": rig.name,
        "criterion": made.asked.criterion,
        "target": made.information.target,
        "candidates": len(made.candidates),
        "poses": len(made.taken.poses),
        "free_space_m": made.free_space_m,
        "random_free_space_m": made.random_m,
        "scale_sigma": made.scale_sigma,
        "hidden_m": made.information.hidden_m,
        "drift_absorbed": made.in_time.absorbed,
        "drift_absorbed_by_short_way": made.in_time.absorbed_before,
        "enough_poses": made.curve.enough,
        "curve": [
            {"poses": int(n), "chosen_m": float(a), "random_m": float(b)}
            for n, a, b in zip(made.curve.poses, made.curve.chosen_m, made.curve.random_m, strict=True)
        ],
        "places": [_place(one) for one in places],
        "smallest": [_name(one.name) | {"parameter": one.parameter, "value": one.value} for one in seen.smallest],
        "confusable": [{"one": _name(a), "other": _name(b), "r2": r2} for a, b, r2 in seen.confusable],
        "invisible": [_name(one) for one in seen.invisible],
        "isolability": {
            "terms": [f"{t.physics} at {t.port.where}" for t in seen.isolability.terms],
            "r2": seen.isolability.r2.tolist(),
        },
    }


def _place(one: Places) -> dict[str, Any]:
    return {
        "ids": list(one.ids),
        "free_space_m": one.free_space_m,
        "scale_sigma": one.scale_sigma,
        "with_distances_m": one.with_distances_m,
        "with_distances_scale_sigma": one.with_distances_scale,
        "distances_needed": one.distances_needed,
    }


def _name(one: Named) -> dict[str, Any]:
    return {
        "where": one.where,
        "depends_on": ",".join(one.depends_on),
        "shape": one.shape,
        "order": one.order,
        "physics": one.physics,
    }
