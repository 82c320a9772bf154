"""The chapter on what the model leaves, and whether it is noise."""

import numpy as np
from numpy.typing import NDArray

from calibrate.report.colour_key import colour_key, place_name
from calibrate.report.elements import Html, figure, panels, section, table, tag
from calibrate.report.evidence import Evidence, Expected
from calibrate.report.quantities import angle, doubted_angle, doubted_length, fixed, length, significant
from calibrate.report.residual_figures import COORDINATES, by_pose, histogram, quantiles
from calibrate.report.verdict import UNLIKELY
from calibrate.zeros.result import ZeroResult

Floats = NDArray[np.float64]

TITLE = "Residuals and noise"
NONE = "too small to be told from none"


def residuals(evidence: Evidence) -> Html:
    """Before and after, by place, against noise; repeats and unseen poses."""
    result, expected = evidence.result, evidence.expected
    lead = (
        "Expected minus observed spot. Before: arm as drawn, fixture and laser where they fit best. "
        "After: everything fitted."
    )
    if expected is None:
        return section("residuals", TITLE, lead, tag("p", f"There is no finite fit to judge: {result.status.value}."))
    return section(
        "residuals",
        TITLE,
        lead,
        colour_key(evidence.places),
        _courses(evidence, expected),
        _by_place(evidence),
        tag("h3", "Is what remains noise?"),
        _shapes(expected),
        _noise(result),
        _proofs(result, expected),
    )


def _courses(evidence: Evidence, expected: Expected) -> Html:
    result, data, places = evidence.result, evidence.data, evidence.places
    before = by_pose(data, result.residual_before_m, None, places, "residual-before", "Before")
    after = by_pose(data, result.residual_after_m, expected.sigma_m, places, "residual-after", "After")
    return panels(
        figure(
            before,
            f"Before the fit, {length(result.rms_before_m)} rms: on its own scale; the noise would be a hairline here.",
        ),
        figure(
            after,
            f"After the fit, {length(result.rms_after_m)} rms. The grey band is two sigma of the noise, pose by pose; "
            "95 % of the points should lie in it, without a pattern. Circles: PSD 1 struck first; triangles: PSD 2.",
        ),
    )


def _by_place(evidence: Evidence) -> Html:
    rows: list[tuple[str, ...]] = []
    for place in evidence.places:
        at = evidence.data.placement == place
        rows.append((place_name(place), *_rms_pairs(evidence.result, at)))
    rows.append(("all", *_rms_pairs(evidence.result, np.ones(len(evidence.data), dtype=bool))))
    head = ("Place", *COORDINATES)
    return table(head, rows, numeric=(1, 2, 3, 4), caption="Rms in µm, before → after")


def _rms_pairs(result: ZeroResult, rows: NDArray[np.bool_]) -> list[str]:
    before, after = (
        np.sqrt(np.mean(r[rows] ** 2, axis=0)) * 1e6 for r in (result.residual_before_m, result.residual_after_m)
    )
    return [f"{significant(b)} → {fixed(a, 2)}" for b, a in zip(before.tolist(), after.tolist(), strict=True)]


def _shapes(expected: Expected) -> Html:
    beyond = int(np.sum(np.abs(expected.whitened) > 3.0))
    return panels(
        figure(
            quantiles(expected.whitened),
            "Points on the line within the grey corridor: pure noise. An S shape: outliers. A flatter line is usual, "
            "because the fit follows some of the noise.",
        ),
        figure(
            histogram(expected.whitened),
            f"{beyond} of {expected.whitened.size} coordinates lie beyond three sigma; noise alone would put "
            f"{significant(0.0027 * expected.whitened.size, 2)} there.",
        ),
    )


def _noise(result: ZeroResult) -> Html:
    n = result.noise
    rows = [
        (
            "joints",
            angle(n.joint_believed_rad),
            NONE if n.joint_at_zero else doubted_angle(n.joint_rad, n.joint_sigma_rad),
            "" if n.joint_at_zero else _ratio(n.joint_rad, n.joint_believed_rad),
        ),
        (
            "detectors (median of the averaged spots)",
            length(n.psd_believed_m),
            NONE if n.psd_at_zero else doubted_length(n.psd_m, n.psd_sigma_m),
            "" if n.psd_at_zero else _ratio(n.psd_m, n.psd_believed_m),
        ),
    ]
    head = ("Noise, one sigma", "believed", "found in the residuals", "found / believed")
    return table(head, rows, numeric=(1, 2, 3), caption="Noise as believed and as found")


def _ratio(found: float, believed: float) -> str:
    return fixed(found / believed, 2) if believed > 0.0 else ""


def _proofs(result: ZeroResult, expected: Expected) -> Html:
    n, repeats, unseen = result.noise, result.repeats, result.held_out
    rows: list[tuple[str, ...]] = [
        (
            "Noise floor",
            length(expected.floor_m),
            f"{length(expected.from_joints_m)} by joints, {length(expected.from_detectors_m)} by detectors",
        ),
        (
            "chi²/dof, believed noise",
            fixed(n.chi2_per_dof_believed, 3),
            "near 1 where noise and model are as believed",
        ),
        ("chi²/dof, noise found", fixed(n.chi2_per_dof, 3), "near 1 by construction"),
    ]
    if repeats is None:
        rows.append(("Repeats", "none: no pose was repeated, so a lack of fit cannot be told from noise"))
    else:
        fits = "physics is missing from the model" if repeats.lack_of_fit_p < UNLIKELY else "no sign of missing physics"
        rows += [
            (
                "Repeats, chi²/dof",
                fixed(repeats.chi2_per_dof, 3),
                f"{repeats.groups} groups, {repeats.dof} degrees of freedom; owes nothing to geometry",
            ),
            ("Lack of fit, F", fixed(repeats.lack_of_fit, 3), f"p = {significant(repeats.lack_of_fit_p, 2)}: {fits}"),
        ]
    if unseen is None:
        rows.append(("Unseen poses", "none: no pose was kept out of the fit"))
    else:
        rows += [
            ("Unseen poses, before", length(unseen.rms_before_m), f"{unseen.poses} poses, {unseen.split}"),
            (
                "Unseen poses, after",
                length(unseen.rms_after_m),
                f"{fixed(unseen.chi_after, 2)} times the noise; near 1, with the doubt of the fit on top",
            ),
        ]
    return table(("Test", "value", "reads as"), rows, numeric=(1,), caption="Proofs")
