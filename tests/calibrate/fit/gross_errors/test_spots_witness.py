"""The dual PSD as a witness: a healthy session says nothing, another convention is named by its column."""

import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from calibrate.fit.gross_errors.conventions import wrong_convention
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.parameters import start_values
from calibrate.model.sensors.catalogue import witnesses_of
from calibrate.model.sensors.spots import SpotsWitness

SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture
def lit(sessions):
    return sessions(61, n=90)


def heard(rig, lit, **changed):
    """The witness of a file with these columns written otherwise."""
    columns = {f"q{i + 1}_rad": lit.q_rad[:, i] for i in range(6)} | dict(zip(SPOTS, lit.spots_m.T, strict=True))
    columns |= {"placement": lit.placement.astype(float), "first_psd": lit.first_psd.astype(float), **changed}
    samples = Samples({"t_s": np.arange(len(lit.q_rad), dtype=float), **columns}, 6)
    (witness,) = witnesses_of(rig, samples, samples.joints())
    assert isinstance(witness, SpotsWitness)
    return witness


def drawn(rig):
    arm = arm_of(rig)
    return lambda q: arm.flange(start_values(arm.parameters), q)


def test_a_healthy_session_is_strained_by_zeros_and_places_alone(rig, lit):
    one = heard(rig, lit)
    strain = one.strain(drawn(rig)(one.q_rad))
    assert 1e-4 < strain.typical_m < 0.03  # zeros are off by up to 2 degrees
    assert wrong_convention(drawn(rig), [one]) is None


def test_the_true_arm_is_hardly_strained_and_its_fixtures_stand_where_they_are(rig, lit):
    one, truth = heard(rig, lit), lit.truth
    flanges = np.array([truth.flange(q + truth.zeros) for q in one.q_rad])
    strain = one.strain(flanges)
    assert strain.typical_m < 3e-3  # the laser's mount and the second face are a little beside the drawing
    assert strain.moved_m < 0.01


def test_exchanged_detectors_are_named(rig, lit):
    found = wrong_convention(drawn(rig), [heard(rig, lit, first_psd=3.0 - lit.first_psd)])
    assert (found.kind, found.column) == (GrossErrorKind.EXCHANGED_PSD, "column first_psd")


def test_spots_in_millimetres_are_named(rig, lit):
    columns = {name: 1e3 * spot for name, spot in zip(SPOTS, lit.spots_m.T, strict=True)}
    found = wrong_convention(drawn(rig), [heard(rig, lit, **columns)])
    assert found.kind is GrossErrorKind.MILLIMETRES
    assert "psd1_x_m" in found.says


@pytest.mark.parametrize("joint", [2, 3, 4, 5])
def test_a_joint_counted_the_other_way_round_is_named(rig, lit, joint):
    found = wrong_convention(drawn(rig), [heard(rig, lit, **{f"q{joint}_rad": -lit.q_rad[:, joint - 1]})])
    assert f"column q{joint}_rad: joint {joint} turns against" in found.says
