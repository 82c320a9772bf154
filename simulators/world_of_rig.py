"""Which world a rig is emulated by: one with a robot, a laser and a fixture, or one with a hand on a measuring arm."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from simulators.defects import Defect
from simulators.hand.hand_rig import write_hand_truth
from simulators.hand.rig import is_hand_held, read_hand_rig
from simulators.hand.world import HandWorld
from simulators.world.errors import WorldError
from simulators.world.rig import read_rig
from simulators.world.truth import Given, write_truth
from simulators.world.world import World


@dataclass(frozen=True)
class EmulatedWorld:
    """A world and what the process that serves it wants to know."""

    physics: World | HandWorld
    verbs: Mapping[str, Callable[..., Any]]  # of the side channel, beside those of the devices
    time_scale: float  # as the rig says
    write_truth: Callable[[Path], None]


def world_of(
    rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect], given: Given | None = None
) -> EmulatedWorld:
    """The world of a rig as `tomllib` gives it. WorldError for one that cannot be emulated.

    `given`: its geometry in numbers, instead of one that the seed draws.
    """
    if not is_hand_held(rig):
        return _driven(rig, seed, hidden, given)
    if given is not None:
        raise WorldError("a hand-held arm has its geometry in [emulation]; leave the model out")
    return _hand_held(rig, seed, hidden)


def _driven(rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect], given: Given | None) -> EmulatedWorld:
    home_rad = rig.get("motion", {}).get("home_rad")
    world = World.from_rig(rig, seed=seed, q_rad=home_rad, hidden=hidden, given=given)

    def place(id: int) -> None:  # noqa: A002 - the verb's argument is called id
        world.place_fixture(id)

    time_scale = read_rig(rig).emulation.time_scale
    return EmulatedWorld(world, {"fixture.place": place}, time_scale, partial(write_truth, world.truth))


def _hand_held(rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect]) -> EmulatedWorld:
    if hidden:
        kinds = ", ".join(defect.KIND for defect in hidden)
        raise WorldError(f"hidden {kinds}: a hand-held arm has its mechanisms in [emulation]; set them there")
    world = HandWorld.from_rig(rig, seed=seed)
    time_scale = read_hand_rig(rig).emulation.time_scale
    return EmulatedWorld(world, world.verbs, time_scale, partial(write_hand_truth, world.truth))
