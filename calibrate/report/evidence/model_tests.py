"""The tests that a model.json carries, each as a record that chapters can read; absent ones are None or empty."""

from dataclasses import dataclass
from math import nan, sqrt

from calibrate.fit.accuracy import Alarm
from calibrate.model.model_file import Fields, ModelFile, UnseenRows


@dataclass(frozen=True)
class ScatterTest:
    """Chi-square under the noise as assumed."""

    chi2: float
    dof: int
    p: float | None
    alarm: Alarm

    @property
    def factor(self) -> float:
        """Misfit over assumed noise; nan without redundancy."""
        return sqrt(self.chi2 / self.dof) if self.dof > 0 else nan


@dataclass(frozen=True)
class Repeated:
    """Scatter of repeated poses, and how much larger the misfit is."""

    groups: int
    dof: int
    chi2_per_dof: float
    ratio: float | None
    p: float | None
    alarm: Alarm


def proofs(model: ModelFile) -> tuple[UnseenRows, ...]:
    """One an instrument and split; of a model from before there were several splits, the one that it has."""
    held = model.held_out
    if model.proofs or held is None:
        return model.proofs
    out: list[UnseenRows] = []
    for name in model.instruments:
        before, after = (_distance(held, f"{name}_rms_distance_{state}") for state in ("before", "after"))
        if before is None or after is None:
            continue
        count, chi = int(_number(held, f"{name}_observations") or 0), _number(held, "chi_after")
        out.append(UnseenRows(str(held.get("split")), name, count, before, after, nan if chi is None else chi))
    return tuple(out)


def _distance(held: Fields, key: str) -> float | None:
    """In the unit that the key names; models of before December 2026 named all of them lengths."""
    return next((value for unit in ("m", "rad") if (value := _number(held, f"{key}_{unit}")) is not None), None)


def fit_end(model: ModelFile) -> tuple[str, int, str] | None:
    """Solver and loss, iterations of all rounds, the rule that ended it; None in models of earlier versions."""
    end = model.fit
    return None if end is None else (f"{end.method}, {end.loss}", end.iterations, f"{end.ended_by}: {end.says}")


def scatter(model: ModelFile) -> ScatterTest | None:
    """None in a model that was written before there was this test."""
    chi2, dof = _number(model.noise, "chi2_stated"), _number(model.noise, "dof")
    alarm = model.noise.get("alarm")
    if chi2 is None or dof is None or not isinstance(alarm, str):
        return None
    return ScatterTest(chi2, int(dof), _number(model.noise, "p_stated"), Alarm[alarm])


def repeated(model: ModelFile) -> Repeated | None:
    """None where no pose was repeated."""
    found = model.repeats
    alarm = None if found is None else found.get("alarm")
    if found is None or not isinstance(alarm, str):
        return None
    return Repeated(
        int(_number(found, "groups") or 0),
        int(_number(found, "dof") or 0),
        _number(found, "chi2_per_dof") or nan,
        _number(found, "ratio"),
        _number(found, "p_above"),
        Alarm[alarm],
    )


def _number(fields: Fields, name: str) -> float | None:
    value = fields.get(name)
    return None if value is None or isinstance(value, str | bool) else float(value)
