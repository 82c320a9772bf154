"""Troubles that were met on real robots, as cases of the kind `raised`: each in turn, on request.

What each may be called, and where, follows from its mechanism (`simulators.defects.RAISED`). Two have none: a rig file
in the wrong convention, and a thermometer that nothing depends on. Of some more than one diagnosis is asked: a
comparison with a simulation, or a replay.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from numpy.random import Generator

from simulators.conceal.wanted import SIDES, Family, Wanted

SURE = 0.5  # confidence from which a wrong name of a raised trouble counts
SAID_OF_CONVENTION = (
    "denavit",
    "convention",
    "mdh",
)  # words in a fault of the file, or in the reason why it was refused


@dataclass(frozen=True)
class Trouble:
    """What is hidden by instrument, one of several at random, and what else differs from other sessions."""

    defects: Mapping[Family, tuple[tuple[str, ...], ...]]
    changes: Callable[[Generator], dict[str, Any]] = lambda rng: {}

    def wanted(self, plain: Wanted, rng: Generator) -> Wanted:
        """The session `plain` with this trouble."""
        choices, changes = self.defects[plain.family], self.changes(rng)
        return replace(plain, defects=choices[int(rng.integers(len(choices)))], **changes)


def _second_encoders(rng: Generator) -> dict[str, Any]:
    return {"encoders": SIDES[int(rng.integers(len(SIDES)))], "side_stated": bool(rng.random() < 0.5)}


def _drifting(rng: Generator) -> dict[str, Any]:
    return {"thermometer_k": float(rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 6.0))}


def _always(**changes: Any) -> Callable[[Generator], dict[str, Any]]:
    return lambda rng: dict(changes)


def _few(rng: Generator) -> dict[str, Any]:
    enr = float(rng.uniform(PLAIN_IN_FEW, 2.0 * PLAIN_IN_FEW))
    return {"samples": int(rng.integers(16, 20)), "enr": enr, "at_least": 0.95 * PLAIN_IN_FEW}


def _hidden(*names: str, families: tuple[Family, ...]) -> Mapping[Family, tuple[tuple[str, ...], ...]]:
    return dict.fromkeys(families, (names,))


PLAIN_IN_FEW = 6.0  # effect over noise
REPLAYED = "three-targets"  # `reconcile` is asked, too
FEW_ROWS = "few-rows"
OF_JOINTS = (("soft-joint",), ("slack-drive",), ("encoder-eccentricity",))
ROBOTS: tuple[Family, ...] = ("dual-psd", "tracker")
DRIVEN: tuple[Family, ...] = ("dual-psd", "tracker", "wire")
TROUBLES: Mapping[str, Trouble] = {
    "detector-local-defect": Trouble(_hidden("psd-spot", families=("dual-psd",))),
    "fixture-knocked": Trouble({"dual-psd": (("knocked-table",),), "cones": (("knocked-plate",),)}),
    "load-hysteresis": Trouble(_hidden("hysteretic-spring", families=ROBOTS)),
    "lagging-temperature": Trouble(_hidden("lagging-link", families=(*ROBOTS, "cones"))),
    "one-sided-stiffness": Trouble(_hidden("one-sided-spring", families=ROBOTS)),
    "wrong-load-centre": Trouble(_hidden("wrong-load-centre", families=ROBOTS)),
    "temporary-shift": Trouble(
        {"dual-psd": (("briefly-shifted-base",), ("briefly-shifted-laser",)), "cones": (("briefly-shifted-base",),)},
        _always(at_least=0.6),  # some positions of a fixture have no reading of before or after
    ),
    "two-soft-joints-second-encoders": Trouble(_hidden("soft-joint", "soft-joint", families=DRIVEN), _second_encoders),
    "confused-convention": Trouble(_hidden(families=ROBOTS), lambda rng: {"confused": True}),
    "missing-column": Trouble(_hidden("any", families=DRIVEN), lambda rng: {"withhold": True}),
    "room-temperature": Trouble(_hidden(families=(*ROBOTS, "cones")), _drifting),
    "simulation-has-too-much": Trouble({"tracker": (*OF_JOINTS, ("bending-link",))}, _always(beside="too-much")),
    "geometry-off": Trouble(_hidden(families=("tracker",)), _always(beside="constants")),
    REPLAYED: Trouble({"tracker": OF_JOINTS}, _always(targets=3)),
    FEW_ROWS: Trouble({"tracker": OF_JOINTS}, _few),
    "six-d-target": Trouble({"tracker": (*OF_JOINTS, ("bending-link",))}, _always(six_d=True)),
}
