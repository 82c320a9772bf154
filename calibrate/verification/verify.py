"""Verification of an identified arm: the figures of both standards from a recording that the fit has not seen."""

from collections.abc import Callable
from dataclasses import dataclass

from acquisition.recording import Recording
from calibrate.model_file import ModelFile
from calibrate.predict import Predictor
from calibrate.verification import b89_4_22, iso10360_12
from calibrate.verification.figure import Figure, Judgement
from calibrate.verification.measured import Measured, measured
from calibrate.verification.model_fits import refuse_wrong_model

STANDARDS: tuple[Callable[[Measured], tuple[Figure, ...]], ...] = (iso10360_12.figures, b89_4_22.figures)


@dataclass(frozen=True)
class Verification:
    """Figures in the order of the standards."""

    figures: tuple[Figure, ...]
    samples: int
    left_out: tuple[str, ...] = ()  # series of touches that show no sphere, and why

    @property
    def failed(self) -> tuple[Figure, ...]:
        """Beyond what is permitted."""
        return tuple(figure for figure in self.figures if figure.judgement is Judgement.FAILS)

    @property
    def judged(self) -> tuple[Figure, ...]:
        """Those with a limit and a value."""
        return tuple(f for f in self.figures if f.judgement in (Judgement.CONFORMS, Judgement.FAILS))

    @property
    def sentence(self) -> str:
        """For a person, first."""
        if not self.judged:
            return "Nothing was judged: state permissible errors in the rig's [mpe]."
        if self.failed:
            return (
                f"Does not conform: {', '.join(figure.symbol for figure in self.failed)} beyond the permissible error."
            )
        parts = [figure.symbol for figure in self.judged if not figure.complete]
        rest = f" Part of the test only, with fewer measurements than it asks for: {', '.join(parts)}." if parts else ""
        rest += " Series were left out." if self.left_out else ""
        return f"Conforms in all {len(self.judged)} figures that were judged.{rest}"


def verify(recording: Recording, model: ModelFile) -> Verification:
    """DataError where the recording holds nothing to verify by, or the model is of another arm or of these readings."""
    refuse_wrong_model(recording, model)
    found = measured(recording.samples, recording.rig, Predictor.of(model))
    iso10360_12.refuse_without_probe(found)
    figures = tuple(f for figures in STANDARDS for f in figures(found))
    return Verification(figures, len(recording.samples), found.left_out)
