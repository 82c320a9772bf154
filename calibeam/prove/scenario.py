"""Which cases a proof conceals: kinds, families, sizes and noise, all drawn from one published seed.

Shares of the mix: more than half of the cases are none of "one effect in white noise", since a diagnosis that always
names something would shine there.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeVar, get_args

import numpy as np
from numpy.random import Generator

from calibeam.prove.raised import TROUBLES
from simulators.conceal.motion.motion_case import ARMS_IN_MOTION
from simulators.conceal.wanted import FAMILIES, SIDES, Family, Wanted
from simulators.conceal.wanted import Kind as Noise

T = TypeVar("T")
Path = Literal["in process", "on wires"]  # how the recording comes about
Kind = Literal[
    "one", "disturbed", "three", "eighteen", "none", "outside", "withheld", "streams", "encoders", "raised", "motion"
]
ON_REQUEST: tuple[Kind, ...] = ("encoders", "raised", "motion")
KINDS: tuple[Kind, ...] = tuple(k for k in get_args(Kind) if k not in ON_REQUEST)  # of a proof that names none
SHARES: dict[Kind, float] = {
    "one": 0.42,
    "disturbed": 0.06,  # one effect under heavy-tailed noise with outliers, or slowly wandering noise
    "three": 0.08,
    "eighteen": 0.02,
    "none": 0.14,
    "outside": 0.15,
    "withheld": 0.08,
    "encoders": 0.1,  # something of machine-like size between the two encoders of a joint, or nothing; on request
    "raised": 0.1,  # troubles that were met on real robots, in turns; on request
    "streams": 0.05,  # nothing wrong with the chain; with motion, stamps or second encoders, in three of four
    "motion": 0.1,  # torques that were left out of a recorded motion, or nothing; on request
}
FAMILY_SHARES: dict[Family, float] = {"dual-psd": 0.5, "tracker": 0.25, "cones": 0.125, "wire": 0.125}
DEFECTS: dict[Kind, tuple[str, ...]] = {
    "one": ("any",),
    "disturbed": ("any",),
    "three": ("any",) * 3,
    "eighteen": ("any",) * 18,
    "none": (),
    "outside": ("outside",),
    "withheld": ("any",),
    "streams": (),
    "encoders": ("any",),
    "raised": (),  # each trouble has its own
    "motion": ("any",),  # none to three, or one that no catalogue lists
}
ENR = (0.15, 8.0)  # effect over noise: from hardly there to plain
ENR_OF: dict[Kind, tuple[float, float]] = {  # one that must be noticed before it can be named
    "three": (0.6, 4.0),
    "eighteen": (0.6, 3.0),
    "outside": (0.6, 5.0),
    "withheld": (0.6, 5.0),
    "raised": (1.0, 6.0),
}
SAMPLES = (160, 400)
MANY_SAMPLES = 400  # of a session with eighteen effects: each has several parameters
PLACES = (3, 6)
STREAMED_SAMPLES = (60, 90)  # some minutes of motion
SIDE_SHARES = (0.5, 0.25, 0.25)  # link, motor, beside
NO_FAULT = 0.2  # share of the cases with second encoders in which there is only their zeros
WIRED: tuple[Kind, ...] = ("one", "one", "outside", "none")  # in turns, of the sessions on the wires
WIRED_SAMPLES = 120  # a minute of ours
WIRED_PLACES = 3  # of the rig that is emulated
WIRED_ENR = (0.8, 6.0)
WIRED_DRAWS = 3  # a minute each
MOTIONS: tuple[tuple[tuple[str, ...], float], ...] = (  # what is hidden, and its share
    ((), 0.15),
    (("outside",), 0.15),
    (("any",), 0.3),
    (("any",) * 2, 0.25),
    (("any",) * 3, 0.15),
)
MOTION_SAMPLES = 10_000  # 20 s at 500 Hz
WIRED_ARM = "ur5e"  # of motions: the emulated controller is that of this arm
DEVELOPMENT = 1000  # seeds below have been looked at while the diagnosis was made: no published figure may use them
DRAWS = 40  # of one case, before it is given up: a seed may give a rig that reaches too few poses


@dataclass(frozen=True)
class Mix:
    """What the cases of a proof are drawn from."""

    kinds: Sequence[Kind] = KINDS
    families: Sequence[Family] = FAMILIES
    enr: tuple[float, float] | None = None  # None: as each kind has it
    mechanism: str | None = None  # one by name, for kinds with one effect; a trouble, for the kind of these
    shares: Mapping[Kind, float] = field(default_factory=lambda: SHARES)

    def defects(self, kind: Kind) -> tuple[str, ...]:
        """Mechanisms to hide in a case: the one by name where the kind has one effect."""
        one = self.mechanism is not None and DEFECTS[kind] == ("any",)
        return (self.mechanism,) if one and self.mechanism is not None else DEFECTS[kind]


@dataclass(frozen=True)
class Scenario:
    """One case before it is drawn. Its name gives nothing away."""

    name: str
    kind: Kind
    wanted: Wanted
    path: Path = "in process"
    trouble: str = ""  # of the kind `raised`


def scenario(mix: Mix, seed: int, number: int, attempt: int) -> Scenario:
    """Case `number` of a proof. An attempt of a case that could not be drawn keeps its kind, family and size."""
    rng = np.random.default_rng([seed, number])
    kind = _one_of(mix.kinds, [mix.shares[k] for k in mix.kinds], rng)
    if kind == "motion":
        arm = ARMS_IN_MOTION[number % len(ARMS_IN_MOTION)]
        return _motion(mix, number, _seed(seed, number, attempt), arm, rng)
    trouble = (mix.mechanism or tuple(TROUBLES)[number % len(TROUBLES)]) if kind == "raised" else ""
    families = _able(mix.families, tuple(TROUBLES[trouble].defects)) if trouble else _able_of(mix.families, kind)
    family = _one_of(families, [FAMILY_SHARES[f] for f in families], rng)
    low, high = mix.enr or ENR_OF.get(kind, ENR)
    few, most = STREAMED_SAMPLES if kind == "streams" else SAMPLES
    wanted = Wanted(
        family=family,
        seed=_seed(seed, number, attempt),
        defects=mix.defects(kind),
        enr=float(np.exp(rng.uniform(np.log(low), np.log(high)))),
        samples=MANY_SAMPLES if kind == "eighteen" else int(rng.integers(few, most + 1)),
        places=max(PLACES) if kind == "eighteen" else int(rng.choice(PLACES)),
        noise=_noise(kind, rng),
        withhold=kind == "withheld",
    )
    if kind == "encoders":
        wanted = _with_encoders(wanted, rng)
    if trouble:
        wanted = TROUBLES[trouble].wanted(wanted, rng)
    return Scenario(f"case-{number:04d}", kind, wanted, trouble=trouble)


def wired_scenario(mix: Mix, seed: int, number: int, attempt: int) -> Scenario:
    """Case `number` of a proof that goes over the wires."""
    rng = np.random.default_rng([seed, number])
    if set(mix.kinds) == {"motion"}:
        return replace(_motion(mix, number, _seed(seed, number, attempt), WIRED_ARM, rng), path="on wires")
    kind = WIRED[number % len(WIRED)]
    low, high = WIRED_ENR
    wanted = Wanted(
        family="dual-psd",
        seed=_seed(seed, number, attempt),
        defects=mix.defects(kind),
        enr=float(np.exp(rng.uniform(np.log(low), np.log(high)))),
        samples=WIRED_SAMPLES,
        places=WIRED_PLACES,
    )
    return Scenario(f"case-{number:04d}", kind, wanted, "on wires")


def _motion(mix: Mix, number: int, seed: int, arm: str, rng: Generator) -> Scenario:
    """An arm in motion; its instrument has no part in it."""
    many, shares = zip(*MOTIONS, strict=True)
    defects = many[int(rng.choice(len(many), p=shares))]
    if mix.mechanism is not None:
        defects = (mix.mechanism,)
    wanted = Wanted("tracker", seed=seed, defects=defects, samples=MOTION_SAMPLES, arm=arm)
    return Scenario(f"case-{number:04d}", "motion", wanted)


def _with_encoders(wanted: Wanted, rng: Generator) -> Wanted:
    """Second encoders on any side of the gear, stated in the rig file or not; some sessions have only their zeros."""
    nothing = wanted.defects == ("any",) and rng.random() < NO_FAULT
    return replace(
        wanted,
        defects=() if nothing else wanted.defects,
        encoders=_one_of(SIDES, SIDE_SHARES, rng),
        side_stated=bool(rng.random() < 0.5),
    )


def _able_of(families: Sequence[Family], kind: Kind) -> Sequence[Family]:
    """Eighteen effects have room in a session with two detectors only, which alone leave streams of spots.

    Cones have next to no column to withhold.
    """
    narrow: dict[Kind, tuple[Family, ...]] = {
        "eighteen": ("dual-psd",),
        "streams": ("dual-psd",),
        "withheld": ("dual-psd", "tracker", "wire"),
        "encoders": ("dual-psd", "tracker", "wire"),
    }
    wide: tuple[Family, ...] = FAMILIES
    return _able(families, narrow.get(kind, wide))


def _able(families: Sequence[Family], possible: Sequence[Family]) -> Sequence[Family]:
    return [f for f in families if f in possible] or list(possible)


def _noise(kind: Kind, rng: Generator) -> Noise:
    match kind:
        case "none":
            return _one_of(("white", "heavy", "wandering"), (1.0, 1.0, 1.0), rng)
        case "disturbed":
            return _one_of(("heavy", "wandering"), (1.0, 1.0), rng)
        case _:
            return "white"


def _seed(seed: int, number: int, attempt: int) -> int:
    """Never one of the development seeds, and nothing that a recording could be recognised by."""
    digest = hashlib.sha256(f"calibeam proof {seed} {number} {attempt}".encode()).digest()
    return DEVELOPMENT + int.from_bytes(digest[:6], "big")


def _one_of(choices: Sequence[T], shares: Sequence[float], rng: Generator) -> T:
    total = float(np.sum(shares))
    return choices[int(rng.choice(len(choices), p=[s / total for s in shares]))]
