"""The fit plan: what a user wants of an identification, as a TOML file with one clear error for what is wrong in it.

Keys are those of docs/formats.md. Patterns are shell patterns over parameter names: "link*.length", "joint6.zero".
"""

import enum
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from acquisition.recording.files import KeyPath, parse_toml, read_text
from acquisition.recording.files.bounds import Count, Few, Name, Positive
from acquisition.recording.rig import ArmModel
from calibrate.errors import DataError
from calibrate.fit.held_out.splits import SplitKind
from calibrate.fit.rank.observability import Redundant
from calibrate.fit.solvers import DogLegRules, Loss, Method
from calibrate.model.sensors.catalogue import BY_NAME, SENSORS, names_with
from calibrate.model.sensors.kind import Trait

Rounds = Annotated[int, Meta(ge=0, le=100_000)]  # some seconds each


class LossName(enum.Enum):
    """What a residual costs; all but the first forgive far rows."""

    LEAST_SQUARES = "least-squares"
    HUBER = "huber"
    CAUCHY = "cauchy"
    STUDENT_T = "student-t"


class SolverName(enum.Enum):
    """The algorithm."""

    LEVENBERG = "levenberg-marquardt"
    DOGLEG = "dog-leg"


class RedundantName(enum.Enum):
    """What is done with combinations that the data do not see."""

    REMOVED = "removed"
    PRIORS = "priors"


class AnglesName(enum.Enum):
    """Which readings of the joints drive the arm."""

    CONTROLLER = "controller"
    ENCODERS = "encoders"  # the second ones, in the controller's sense and about its zeros


Limit = Annotated[float, Meta(ge=0.0, le=1e12)]  # whitened and scaled, so that 1 is a noise or a plausible size


class MethodName(enum.Enum):
    """A method beside the fit, for comparison; the model stays that of the fit."""

    POINT_CONSTRAINT = "point-constraint"  # joint zeros from centred poses: calibrate/fit/identify/point_constraint.py


class DogLeg(Struct, frozen=True, forbid_unknown_fields=True):
    """The numbers of Dog-Leg (calibrate/fit/solvers/trust_region.py), each absent one as it is without a plan."""

    e1: Limit = DogLegRules.e1
    e2: Limit = DogLegRules.e2
    e3: Limit = DogLegRules.e3
    kmax: Annotated[int, Meta(ge=1, le=100_000)] = DogLegRules.kmax
    delta0: Annotated[float, Meta(ge=1e-12, le=1e12)] = DogLegRules.radius
    sigma: Annotated[float, Meta(ge=0.0, le=0.75)] = DogLegRules.sigma  # above 3/4 the radius grows


class FitPlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole plan; every key but `schema` may be absent and then leaves things as they are without a plan."""

    schema: Literal[1]
    model: ArmModel | None = None  # the rig's arm is written again in this model
    instruments: Few[
        Name
    ] = ()  # sensors by name, of calibrate/model/sensors/catalogue.py; none: all that the samples allow
    angles: AnglesName = AnglesName.CONTROLLER
    free: Few[Name] = ()  # without an opinion of the drawing
    priors: Mapping[Name, Positive] = {}  # pattern -> one sigma about the drawing, m or rad; a later one wins
    hold: Few[Name] = ()  # nominal; wins over `free` and `priors`
    method: MethodName | None = None
    loss: LossName = LossName.LEAST_SQUARES
    solver: SolverName = SolverName.LEVENBERG
    dog_leg: DogLeg | None = field(name="dog-leg", default=None)
    redundant: RedundantName = RedundantName.REMOVED
    splits: Few[SplitKind] = tuple(SplitKind)
    share: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.2  # of the rows, held out; 0: no proof
    seed: Count = 1  # of everything that is drawn: the same plan and samples give the same model
    bootstrap: Rounds = 0  # rounds

    @property
    def robust_loss(self) -> Loss:
        return LOSSES[self.loss]

    @property
    def algorithm(self) -> Method:
        return METHODS[self.solver]

    @property
    def rules(self) -> DogLegRules | None:
        """Of Dog-Leg; None: the usual ones."""
        own = self.dog_leg
        return None if own is None else DogLegRules(own.e1, own.e2, own.e3, own.kmax, own.delta0, own.sigma)

    @property
    def of_redundant(self) -> Redundant:
        return REDUNDANT[self.redundant]


LOSSES = {
    LossName.LEAST_SQUARES: Loss.SQUARE,
    LossName.HUBER: Loss.HUBER,
    LossName.CAUCHY: Loss.CAUCHY,
    LossName.STUDENT_T: Loss.STUDENT_T,
}
METHODS = {SolverName.LEVENBERG: Method.LEVENBERG, SolverName.DOGLEG: Method.DOGLEG}
REDUNDANT = {RedundantName.REMOVED: Redundant.REMOVED, RedundantName.PRIORS: Redundant.HELD_BY_PRIORS}

DEFAULT = FitPlan(schema=1)
ZEROS_ONLY_COMMAND = "for the best offsets alone, lengths and axes nominal: calibeam identify REC --zeros-only"


def zeros_only_text(discs: bool) -> str:
    """The plan that holds all of the arm but its joint zeros; `discs`: the rig leaves those of the encoders open."""
    return 'schema = 1\nhold = ["link*"' + (', "joint*.disc_*"' if discs else "") + "]\n"


def read_plan(path: Path) -> tuple[FitPlan, str]:
    """The plan of a file, and its text. DataError naming file, line, key, value and remedy."""
    text = read_text(path, "fit plan", DataError)
    return parse_plan(text, str(path)), text


def parse_plan(text: str, name: str) -> FitPlan:
    """The plan of a text; `name` stands for the file in errors."""
    file = parse_toml(text, name, DataError)
    plan = file.checked(FitPlan)
    for path, says in _contradictions(plan):
        raise file.error(path, says)
    return plan


def _contradictions(plan: FitPlan) -> Iterator[tuple[KeyPath, str]]:
    asked = plan.instruments
    for name in asked:
        if name not in BY_NAME:
            yield ("instruments",), f"instruments = '{name}' in the file: known are {', '.join(BY_NAME)}"
    for kind in SENSORS:
        for other in kind.instead_of:
            if {kind.name, other} <= set(asked):
                yield ("instruments",), f"'{other}' and '{kind.name}' are the same readings; choose one of them"
    if plan.angles is AnglesName.ENCODERS and set(names_with(Trait.BETWEEN_ENCODERS)) & set(asked):
        yield ("angles",), "angles = 'encoders' leaves no encoder-difference to observe; leave one of them out"
    if plan.dog_leg is not None and plan.solver is not SolverName.DOGLEG:
        yield ("dog-leg",), f"[dog-leg] has no meaning for solver = '{plan.solver.value}'; write solver = 'dog-leg'"
    if plan.share == 0.0 and plan.splits != tuple(SplitKind):
        yield ("share",), "share = 0 holds nothing out, so that `splits` has no meaning; leave one of them out"
