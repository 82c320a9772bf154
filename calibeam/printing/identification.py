"""A refitted model as a person reads it in a terminal: what is left of the readings, and each effect with its size."""

from collections.abc import Iterator

from calibrate.model_file import ModelFile
from calibrate.physics.records import Effect
from calibrate.report.quantities import length


def refitted_lines(model: ModelFile) -> Iterator[str]:
    """Of `calibeam identify --model`."""
    determined = sum(p.value is not None for p in model.parameters)
    yield (
        f"{model.poses} samples: {determined} of {len(model.parameters)} parameters of geometry determined, "
        f"{sum(not e.after for e in model.effects)} effects refitted"
    )
    yield (
        f"misfit of {model.instruments[0]}, rms distance: {length(model.rms_distance_before_m)} by geometry alone, "
        f"{length(model.rms_distance_after_m)} with the effects"
    )
    for effect in model.effects:
        if not effect.after:
            yield f"{effect.name}: {', '.join(_sizes(effect)) or 'not determined by these samples'}"


def _sizes(effect: Effect) -> Iterator[str]:
    for name, size in effect.parameters.items():
        if size.value is not None and size.sigma is not None:
            yield f"{name} {size.value:.4g} ± {size.sigma:.2g}"
