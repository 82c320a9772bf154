"""The emulated world of encoders alone: all of them on one shaft that turns to and fro, as on a test stand.

    world = ShaftWorld.from_rig(plain_rig, seed=3)
    world.advance(2.0); world.link_encoders_rad(); world.verbs["shaft.slip"](encoder=2, angle_rad=1e-3)

The shaft swings SWING_TURNS either way in PERIOD_S. Each disc sits at an angle of its own, off its centre and divided
unevenly as [emulation] states. Does not imitate: a shaft that twists, couplings, heat.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.encoders.discs import Discs, TrueDisc, draw_disc
from simulators.errors import WorldError

Floats = NDArray[np.float64]
Sigma = Annotated[float, msgspec.Meta(ge=0.0)]
SWING_TURNS, PERIOD_S = 1.5, 20.0
PLAIN = "can-dbc"  # the rig's word for encoders that are named by signals, not nodes


class ShaftEmulation(msgspec.Struct, frozen=True):
    """How far the discs are from perfect, one sigma each. A missing deviation is zero."""

    seed: Annotated[int, msgspec.Meta(ge=0)] = 0
    time_scale: Annotated[float, msgspec.Meta(gt=0.0)] = 1.0
    disc_eccentricity_m: Sigma = 0.0
    graduation_rad: Sigma = 0.0
    encoder_noise_rad: Sigma = 0.0  # of one reading


class ShaftTruth(msgspec.Struct, frozen=True):
    """The concealed discs, and at which angle each sits on the shaft."""

    seed: int
    joint_zero_rad: tuple[float, ...]
    discs: tuple[TrueDisc, ...]
    encoder_noise_rad: float
    kind: str = "shaft"
    schema: int = 1


def is_shaft(rig: Mapping[str, Any]) -> bool:
    """Whether a rig as `tomllib` gives it is one of encoders without an arm."""
    return "arm" not in rig and "encoders" in rig.get("devices", {})


def read_shaft(rig: Mapping[str, Any]) -> ShaftEmulation:
    """What this world wants of a rig. WorldError naming the key."""
    try:
        return msgspec.convert(dict(rig.get("emulation", {})), type=ShaftEmulation)
    except msgspec.ValidationError as error:
        raise WorldError(f"rig file: [emulation]: {error}") from error


def draw_shaft_truth(rig: Mapping[str, Any], seed: int | None = None) -> ShaftTruth:
    """The same rig and seed always give the same. WorldError for a seed below 0, or [emulation] that cannot be read."""
    sigma, device = read_shaft(rig), rig["devices"]["encoders"]
    seed = sigma.seed if seed is None else seed
    if seed < 0:
        raise WorldError(f"seed {seed}; give a whole number from 0 on")
    n = len(device["signals"] if device.get("driver") == PLAIN else device["nodes"])
    zero, disc = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 8]).spawn(2))
    return ShaftTruth(
        seed,
        tuple(zero.uniform(-math.pi, math.pi, n).tolist()),
        tuple(draw_disc(sigma.disc_eccentricity_m, sigma.graduation_rad, disc) for _ in range(n)),
        sigma.encoder_noise_rad,
    )


class ShaftWorld:
    """The shaft and its discs."""

    def __init__(self, truth: ShaftTruth) -> None:
        self.truth = truth
        self._discs, self._zero_rad = Discs(truth.discs), np.array(truth.joint_zero_rad)
        self._noise = np.random.default_rng([truth.seed, 9])
        self._time_s = 0.0
        self._seen: Floats | None = None

    @classmethod
    def from_rig(cls, rig: Mapping[str, Any], *, seed: int | None = None) -> "ShaftWorld":
        """The world of a rig as `tomllib` gives it; `seed` goes before the one in [emulation]. WorldError if bad."""
        return cls(draw_shaft_truth(rig, seed))

    @property
    def time_s(self) -> float:
        """Emulated seconds since power-on."""
        return self._time_s

    def advance(self, until_s: float) -> None:
        """Time goes on."""
        if until_s > self._time_s:
            self._time_s, self._seen = until_s, None

    def link_encoders_rad(self) -> Floats:
        """(n,) what the heads see of their discs now: not quantised, which is the encoder's own business."""
        if self._seen is not None:
            return self._seen
        turn_rad = math.tau * SWING_TURNS * math.sin(math.tau * self._time_s / PERIOD_S)
        shaft_rad = (turn_rad + self._zero_rad)[None]
        seen_rad = shaft_rad + self._discs.off_centre_rad(shaft_rad) + self._discs.graduation_rad(shaft_rad)
        seen_rad = seen_rad[0] + self.truth.encoder_noise_rad * self._noise.standard_normal(len(self._zero_rad))
        self._seen = seen_rad
        return seen_rad

    @property
    def verbs(self) -> Mapping[str, Callable[..., Any]]:
        """What the side channel may ask for."""
        return {"shaft.slip": self.slip}

    def slip(self, encoder: int, angle_rad: float) -> None:
        """A disc slips on the shaft. WorldError for an encoder, from 1, that is not there."""
        if not 1 <= encoder <= len(self._zero_rad):
            raise WorldError(f"shaft: no encoder {encoder!r}; there are 1 to {len(self._zero_rad)}")
        self._zero_rad[encoder - 1] += angle_rad
        self._seen = None

    def write_truth(self, path: Path) -> None:
        """As JSON, SI names with their units; folders are made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(msgspec.json.format(msgspec.json.encode(self.truth), indent=1) + b"\n")
