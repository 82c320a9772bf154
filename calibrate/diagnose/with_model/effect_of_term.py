"""An accepted term as an effect of model.json: its name, sizes and coefficients, and the curve of an unknown cause."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess.diagnosis import UNKNOWN, Finding
from calibrate.diagnose.assess.findings import named
from calibrate.model.effect_records import EffectCurve, EffectParameter, EffectRecord
from calibrate.model.effects.catalogue import holds_of
from calibrate.model.effects.curve import TORQUE, SmoothCurve
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place
from calibrate.model.effects.second_encoders import SECOND
from calibrate.model.effects.term import Accepted, Size
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.with_effects.acting import range_of

Floats = NDArray[np.float64]

KNOTS = 33  # of a curve: a wave of the finest of eight eigenfunctions has eight of them
UNITS = (
    *("nms_per_rad", "nm_per_rad", "nm_per_k", "kg_m2", "kg_m", "kg"),
    *("rad_nm", "per_k", "rad", "m", "s", "nm", "share", "k"),
)


def effect_names(accepted: tuple[Accepted, ...]) -> tuple[str, ...]:
    """Unique: "joint2-compliance", "base-moved", "base-moved-2"."""
    out: list[str] = []
    for a in accepted:
        place = a.term.port.where.split(".")[0]
        physics = UNKNOWN if a.term.open else a.term.physics
        kind = place.rstrip("0123456789")
        plain = f"{place}-{physics.removeprefix(f'{kind}-')}"
        count = sum(name == plain or name.startswith(f"{plain}-") for name in out)
        out.append(plain if count == 0 else f"{plain}-{count + 1}")
    return tuple(out)


def effect_of_term(
    a: Accepted, name: str, finding: Finding | None, drivers: Drivers, own: Floats, stated: Mapping[str, Size] | None
) -> EffectRecord:
    """`own` (value, value) covariance of its coefficients and smooth inner values; `stated` sizes without a finding."""
    m, term = len(a.coefficients), a.term
    named_so = finding is not None and not term.open and finding.name.physics != UNKNOWN
    physics = UNKNOWN if term.open or (finding is not None and not named_so) else term.physics
    if finding is not None and named_so:
        sizes = finding.parameters
    elif stated is not None:
        sizes = stated
    else:
        inner_sigma = np.zeros(len(a.inner))
        inner_sigma[term.smooth] = np.sqrt(np.maximum(np.diag(own)[m:], 0.0))
        sizes = term.sizes(a.coefficients, own[:m, :m], a.inner, inner_sigma)
    depends_on = ",".join(term.depends_on)
    values = {driver: range_of(drivers, driver) for driver in depends_on.split(",")}
    return EffectRecord(
        name=name,
        where=term.port.where,
        physics=physics,
        depends_on=depends_on,
        shape=term.shape.value,
        order=term.order,
        variant=SECOND
        if isinstance(term, SmoothCurve) and term.port.instrument == ENCODER_DIFFERENCE
        else term.variant,
        parameters={k: parameter_record(k, size) for k, size in sizes.items()},
        coefficients={f"{name}.c{j}": float(c) for j, c in enumerate(a.coefficients)},
        inner={s.name: float(v) for s, v in zip(term.inner, a.inner, strict=True)},
        about=_about(a, drivers),
        holds=holds_of(term).value,
        range={driver: (float(v.min()), float(v.max())) for driver, v in values.items() if v is not None},
        confidence=None if finding is None else finding.confidence,
        listed="" if physics == term.physics else term.physics,
        curve=_curve(a, drivers, own) if term.open and len(own) == m else None,
        place=term.port.place.value if isinstance(term, SmoothCurve) else "",
        frame=term.port.index if isinstance(term, SmoothCurve) and term.port.place is Place.FRAME else None,
        component=term.component if isinstance(term, SmoothCurve) else None,
        waves=term.waves if isinstance(term, SmoothCurve) else None,
    )


def finding_of(a: Accepted, findings: tuple[Finding, ...]) -> Finding | None:
    """The one that names it, else the unknown cause at its port that has taken it in."""
    for finding in findings:
        if finding.name == named(a.term):
            return finding
    return next((f for f in findings if f.name.physics == UNKNOWN and f.name.where == a.term.port.where), None)


def _about(a: Accepted, drivers: Drivers) -> dict[str, float]:
    """For a person: what times and temperatures are counted from."""
    out: dict[str, float] = {}
    for name in a.term.depends_on:
        if name == "t":
            out["start_t_s"] = float(drivers.t_s.min())
        if (T := drivers.temperatures_degC.get(name.removeprefix("temp_"))) is not None:
            out["reference_degC"] = float(T.mean())
    return out


def parameter_record(name: str, size: Size) -> EffectParameter:
    sigma = number_or_none(size.sigma)
    unit = next((u for u in UNITS if name.endswith(f"_{u}")), "1")
    return EffectParameter(None if sigma is None else number_or_none(size.value), sigma, unit)


def _curve(a: Accepted, drivers: Drivers, covariance: Floats) -> EffectCurve | None:
    """Of an unknown cause of one driver, the component of its port that it moves most."""
    x = range_of(drivers, a.term.depends_on[0]) if len(a.term.depends_on) == 1 else None
    if x is None:
        return None
    basis = a.term.basis(drivers, a.inner)
    amount = basis @ a.coefficients
    component = int(np.argmax(np.ptp(amount, axis=0)))
    order = np.argsort(x, kind="stable")
    knots = np.linspace(float(x.min()), float(x.max()), KNOTS)
    sigma = np.sqrt(np.maximum(np.sum((basis[:, component] @ covariance) * basis[:, component], axis=1), 0.0))
    unit = "rad" if a.term.port.where.endswith(("angle", "tilt", "twist", "direction")) else "m"
    unit = "nm" if a.term.port.where.endswith(TORQUE) else unit
    values, sigmas = (np.interp(knots, x[order], v[order]) for v in (amount[:, component], sigma))
    return EffectCurve(a.term.depends_on[0], unit, *(tuple(v.tolist()) for v in (knots, values, sigmas)))


def number_or_none(value: float) -> float | None:
    """JSON has no word for what is not a number."""
    return value if np.isfinite(value) else None
