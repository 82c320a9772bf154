"""How an identification ends for a script: good, partial, or failed with one sentence that says where and why."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from calibeam.outcome import PartialResult
from calibrate.errors import DataError
from calibrate.fit import Status
from calibrate.identification.estimates import Estimate

UNFINISHED = (Status.OUT_OF_STEPS, Status.STALLED, Status.AT_BOUND)


@contextmanager
def naming(source: Path) -> Generator[None]:
    """DataErrors of what is computed from a recording or session folder, with the file's name before them."""
    try:
        yield
    except DataError as error:
        if str(source) in str(error):
            raise
        raise DataError(f"{source}: {error}") from error


def refuse_nothing(status: Status, estimates: Sequence[Estimate]) -> None:
    """DataError where a fit that came to its end determines not one parameter: its model would say nothing."""
    if status is Status.NOT_FINITE:
        raise DataError(f"nothing can be identified: {status.value}")
    if status not in UNFINISHED and estimates and all(estimate.value is None for estimate in estimates):
        first = next((e for e in estimates if e.why is not None), estimates[0])
        raise DataError(
            f"nothing can be identified: none of {len(estimates)} parameters is determined by these samples "
            f"({first.name}: {first.why}); measure more poses, more different ones, or state in the rig what is known"
        )


def tell_unfinished(status: Status, model: Path) -> None:
    """PartialResult where the fit came to no end: what it had is in the model, but nobody should rely on it."""
    if status in UNFINISHED:
        raise PartialResult(f"{status.value}; what was found so far is in {model}")
