"""Small concealed sessions of every family, with an extra column, temperatures, payload, speeds and commands beside."""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Samples, read
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.drivers import Drivers
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import FAMILIES, Family, Wanted

SEED, SAMPLES = 5, 120
JOINTS = 6


def wanted(family: Family, *, in_turns: bool = False) -> Wanted:
    """What such a session is drawn by; `in_turns`: the arm goes to and fro between stations that are one body."""
    hidden = ("knocked-table",) if in_turns else ()
    return Wanted(family, SEED, hidden, samples=SAMPLES, places=4 if family == "cones" else 3)


@cache
def full_session(family: Family, *, in_turns: bool = False) -> Fitted:
    """Geometry fitted to a session in which every column that an effect can ask for is recorded."""
    with tempfile.TemporaryDirectory() as folder:
        write_case(conceal(wanted(family, in_turns=in_turns)), Path(folder))
        rec = read(Path(folder) / "recording")
    return fit_geometry(session_of(rec.rig, with_every_driver(rec.samples)))


def with_every_driver(samples: Samples) -> Samples:
    """The session with what this family happens not to record drawn at random."""
    rng, n = np.random.default_rng(SEED), len(samples)
    more = {
        "temp_room_degC": 20.0 + np.cumsum(rng.normal(0.0, 0.05, n)),
        "fan_rpm": rng.uniform(1000.0, 2000.0, n),
        "payload_kg": rng.choice([0.0, 2.0], n),
    }
    for joint in range(1, JOINTS + 1):
        more[f"qd{joint}_rad_s"] = rng.normal(0.0, 0.1, n)
        more[f"cmd{joint}_rad"] = samples.column(f"q{joint}_rad") + rng.normal(0.0, 1e-4, n)
        more[f"approach{joint}"] = rng.choice([-1.0, 1.0], n)
    if "placement" in samples:
        more |= {f"psd{k}_sum_v": rng.uniform(1.0, 2.0, n) for k in (1, 2)}
    return replace(samples, columns=dict(samples.columns) | {k: v for k, v in more.items() if k not in samples})


@pytest.fixture(params=FAMILIES)
def fitted(request: pytest.FixtureRequest) -> Fitted:
    return full_session(request.param)


@pytest.fixture
def drivers(fitted: Fitted) -> Drivers:
    return fitted.drivers
