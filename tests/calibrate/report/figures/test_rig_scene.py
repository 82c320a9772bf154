"""The rig in space: beams start at the laser, bounce on the faces by the law of reflection, bones join up."""

import numpy as np
import pytest

from calibrate.model.assumed_rig import AssumedRig
from calibrate.report.evidence.session_evidence import SessionEvidence, SpotSession, spot_session
from calibrate.report.figures.rig_scene import (
    FittedRig,
    Scene,
    fitted_rig,
    scene,
)

# The drawn beam ends on observed spots, the computed one does not know them: they differ by the noise (some um) over
# the distance of the faces (0.08 m).
BEAM_TOLERANCE = 1e-3


@pytest.fixture(scope="module")
def known(spots: SessionEvidence) -> SpotSession:
    session = spot_session(spots)
    assert session is not None
    return session


@pytest.fixture(scope="module")
def rig(known: SpotSession) -> FittedRig:
    return fitted_rig(known)


@pytest.fixture(scope="module")
def drawn(known: SpotSession, rig: FittedRig) -> Scene:
    return scene(rig, known.data, known.places)


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def test_there_is_one_arm_and_one_fixture_a_placement(drawn: Scene, known: SpotSession) -> None:
    assert tuple(arm.placement for arm in drawn.arms) == known.places == tuple(drawn.faces_m)


def test_the_beam_is_reflected_at_equal_angles(drawn: Scene, rig: FittedRig) -> None:
    for arm in drawn.arms:
        normal = rig.faces(arm.placement)[arm.first_psd - 1][:3, 2]
        arriving, leaving = unit(arm.beam_m[1] - arm.beam_m[0]), unit(arm.beam_m[2] - arm.beam_m[1])
        np.testing.assert_allclose(leaving, arriving - 2.0 * (arriving @ normal) * normal, atol=BEAM_TOLERANCE)


def test_faces_are_squares_of_the_size_in_the_rig_file(drawn: Scene, rig: FittedRig) -> None:
    for corners in drawn.faces_m.values():
        sides = np.linalg.norm(np.diff(corners, axis=1, append=corners[:, :1]), axis=2)
        np.testing.assert_allclose(sides, 2.0 * rig.half_size_m)


def test_bones_lead_from_the_base_through_every_axis_to_the_laser(drawn: Scene) -> None:
    for arm in drawn.arms:
        np.testing.assert_allclose(arm.bones_m[0], 0.0)
        np.testing.assert_allclose(arm.bones_m[-1], arm.beam_m[0])
        for point in arm.axes_m:
            assert np.linalg.norm(arm.bones_m - point, axis=1).min() < 1e-9


def test_without_a_fit_the_rig_is_drawn_as_in_its_file(known: SpotSession, rig: FittedRig) -> None:
    place, plain = known.places[0], AssumedRig(known.rig)
    as_drawn = FittedRig(plain, rig.T_psd1_psd2, rig.half_size_m)
    np.testing.assert_allclose(as_drawn.faces(place)[0], plain.T_base_psd1(place))
    assert np.linalg.norm((as_drawn.faces(place) - rig.faces(place))[:, :3, 3], axis=1).max() > 1e-4
