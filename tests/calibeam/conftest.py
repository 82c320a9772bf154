"""The shipped rig, and emulators as a process of their own for tests that need real wires."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from acquisition.recording.rig import Rig, load_rig
from calibeam.emulation import Emulation

from .typist import Typist

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="session")
def rig() -> Rig:
    return load_rig(RIG)


def brisk(rig: Rig) -> Rig:
    """The rig at one place of its fixture, moved near the arm's own limits: a session mostly waits for travel."""
    motion = msgspec.structs.replace(rig.motion, speed_rad_s=3.0, acceleration_rad_s2=15.0)
    return msgspec.structs.replace(rig, placement_list=rig.placement_list[:1], motion=motion)


@pytest.fixture
def emulation() -> Iterator[Emulation]:
    """Emulators of the shipped rig at eight times real time."""
    with Emulation(RIG, seed=5, time_scale=8.0) as running:
        yield running


@pytest.fixture
def typist(monkeypatch: pytest.MonkeyPatch) -> Iterator[Typist]:
    """Standard input is a terminal at which somebody sits, and it is this process's own."""
    person = Typist()
    monkeypatch.setattr(os, "tcgetpgrp", lambda fd: os.getpgrp())
    with os.fdopen(os.dup(person.terminal)) as standard_input:
        monkeypatch.setattr(sys, "stdin", standard_input)
        yield person
    person.close()
