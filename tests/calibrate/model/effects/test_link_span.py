"""One arm in two notations: its links are as long, and bend and wobble at the same places."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.rig import ArmModel
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import convert
from calibrate.model.effects.axis_wobble import EFFECT as WOBBLE
from calibrate.model.effects.drivers import link_vectors
from calibrate.model.effects.link_thermal_growth import EFFECT as GROWTH
from calibrate.model.effects.ports import Perturbation
from calibrate.model.with_effects.ported_chain import flange_twists, perturbed_frames
from tests.calibrate.model.effects.conftest import full_session

NOTHING = np.zeros(0)


def written_as(drivers, model):
    """The session's arm by its drawing, in another notation; only its tool and payload weigh anything."""
    rig = drivers.rig
    arm = rig.arm if rig.arm.model is model else convert(rig.arm, model).arm
    rig = structs.replace(rig, arm=arm)
    built = arm_of(rig, None)
    none = Perturbation.none(len(drivers.t_s), drivers.n_joints)
    frames = perturbed_frames(built, np.zeros(len(built.parameters)), drivers.q_rad, none)
    return replace(drivers, rig=rig, frames=frames)


@pytest.fixture(scope="module")
def both():
    drivers = full_session("tracker").drivers
    assert drivers.rig.arm.model is ArmModel.DH
    return [written_as(drivers, model) for model in (ArmModel.DH, ArmModel.MDH)]


def test_links_are_as_long_in_both(both):
    for link in range(1, both[0].n_joints + 1):
        lengths = [np.linalg.norm(link_vectors(drivers, link), axis=1) for drivers in both]
        assert lengths[1] == pytest.approx(lengths[0], abs=1e-9)


@pytest.mark.parametrize("effect", [WOBBLE, GROWTH], ids=lambda e: e.physics)
def test_the_flange_moves_alike_in_both(both, effect):
    """A wobble may start elsewhere on the turn: the two phases of one span the same."""
    terms = [{t.key: t for t in effect.terms(drivers)} for drivers in both]
    assert set(terms[0]) == set(terms[1])
    for key, term in terms[0].items():
        inner = np.array([spec.grid[0] for spec in term.inner])
        moved = [
            flange_twists(d.frames, some[key].port, some[key].basis(d, inner))
            for d, some in zip(both, terms, strict=True)
        ]
        X, y = (m.reshape(-1, m.shape[2]) for m in moved)
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        assert np.abs(left).max() <= 1e-6 * max(np.abs(y).max(), 1e-12), key
