"""The physics of a model as mechanisms: which effects act, which were left out on purpose, which have none."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibeam.simulation.found import FoundEffect, FoundIn
from calibeam.simulation.mechanism_table import NoMechanismError, at_the_end, mechanism_of
from calibeam.simulation.rig_in_numbers import light_of
from calibrate.errors import DataError
from calibrate.model.effects.ports import Perturbation, Place
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.with_effects.acting import drivers_under, listed
from calibrate.model.with_effects.applied import acting_effects, recorded_samples
from simulators.defects.detector import StrainedFace
from simulators.defects.encoder import RADIUS_M, EccentricDisc
from simulators.replayed import Sited

EXACT = 1e-12  # of a scale that is held at one
FIRST_TURN = 3  # of the six of a frame


@dataclass(frozen=True, eq=False)
class Physics:
    """`mechanisms` act; `every` are those of the whole model, with what was left out; `notes` for a person."""

    mechanisms: tuple[Sited, ...]
    every: tuple[Sited, ...]
    named: tuple[tuple[str, Sited], ...]  # of each effect that acts
    sizes: Mapping[str, str]  # of each effect, rms over the session at its port, with its unit
    notes: tuple[str, ...]


def names_of(model: ModelFile) -> tuple[str, ...]:
    """The effects that can be left out; what a step leaves behind goes with the step."""
    return tuple(effect.name for effect in model.effects if not effect.after)


def physics_of(
    model: ModelFile, predictor: Predictor, n_joints: int, *, same_recording: bool, without: Sequence[str] = ()
) -> Physics:
    """DataError for a name in `without` that the model does not list, or effects that cannot be evaluated."""
    _refuse_unknown(model, without)
    kept = _geometry(predictor)
    acting, notes = acting_effects(model.effects, same_recording, "acts")
    if model.session is None or not acting:
        return Physics(kept, kept, (), {}, notes)
    recorded = recorded_samples(model, n_joints)
    drivers = drivers_under(predictor, recorded, Perturbation.none(len(recorded), n_joints))
    session = FoundIn.of(predictor, drivers)
    every: list[Sited] = []
    named: list[tuple[str, Sited]] = []
    sizes: dict[str, str] = {}
    for (effect, ended), carried in zip(acting, listed([effect for effect, _ in acting], drivers), strict=True):
        found = FoundEffect.of(effect, carried.accepted, session)
        sizes[effect.name] = _size(found)
        try:
            made = mechanism_of(found)
        except NoMechanismError as why:
            at = f"{effect.physics} at {effect.where}"
            notes = (*notes, f"left out: {effect.name} ({at}), {sizes[effect.name]}: {why}")
            continue
        made = Sited(at_the_end(made.defect), made.where) if ended else made
        every.append(made)
        if effect.name in without:
            notes = (*notes, f"left out as asked: {effect.name}, {sizes[effect.name]}")
        else:
            named.append((effect.name, made))
    return Physics((*kept, *(made for _, made in named)), (*kept, *every), tuple(named), sizes, notes)


def _refuse_unknown(model: ModelFile, without: Sequence[str]) -> None:
    names = names_of(model)
    wrong = next((name for name in without if name not in names), None)
    if wrong is not None:
        known = ", ".join(names) if names else "none"
        raise DataError(f"--without {wrong}: the model has no effect of this name; it has {known}")


def _size(found: FoundEffect) -> str:
    """Of the component that it moves most."""
    rms = np.sqrt(np.mean(found.amount**2, axis=0))
    most = int(np.argmax(rms))
    if found.port.place is Place.READING:
        unit = kind_of(found.port.instrument).quantities[0].unit
    else:
        unit = "rad" if found.port.place is Place.JOINTS or most >= FIRST_TURN else "m"
    return f"{rms[most]:.2g} {unit} rms"


def _geometry(predictor: Predictor) -> tuple[Sited, ...]:
    """Discs off their axes and scales of detectors that a model holds as geometry."""
    out: list[Sited] = []
    for joint in range(1, len(predictor.rig.arm.joints) + 1):
        sine, cosine = (predictor.values.get(f"joint{joint}.disc_{part}", 0.0) for part in ("sine", "cosine"))
        if sine or cosine:
            size, bearing_rad = float(np.hypot(sine, cosine)), -float(np.arctan2(cosine, sine))
            out.append(Sited(EccentricDisc(joint, size * RADIUS_M, bearing_rad)))
    found = light_of(predictor)
    if found is not None:
        for psd, (x, y) in enumerate(found[1].reshape(2, 2).tolist(), start=1):
            if max(abs(x - 1.0), abs(y - 1.0)) > EXACT:
                out.append(Sited(StrainedFace(psd, x - 1.0, y - 1.0, 0.0)))
    return tuple(out)
