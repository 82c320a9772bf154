"""The beam strikes both faces where it was sent, by the emulated world's own optics."""

from dataclasses import replace

import numpy as np
import pytest

from simulators.arm.drawing import origin_and_rotation
from simulators.conceal.poses import EDGE, shots
from simulators.conceal.readings import spots, stand
from simulators.conceal.rig import DualPsd
from simulators.conceal.rigs import draw_rig
from simulators.conceal.wanted import Wanted
from simulators.world.optics import Ray, place_faces, trace
from simulators.world.rig import Fixture, Pose


@pytest.fixture(scope="module")
def drawn():
    return draw_rig(Wanted("dual-psd", seed=2, places=1), np.random.default_rng(2))


def test_spots_lie_on_both_faces_and_the_emulated_world_sees_them_there(drawn, scene) -> None:
    true, fixture = drawn.true, drawn.true.instrument
    assert isinstance(fixture, DualPsd)
    taken = shots(true, fixture, 1, 40, 0.0, np.random.default_rng(3))
    assert len(taken.reading_rad) == 40
    now = replace(scene(taken.reading_rad), first_psd=taken.first_psd)
    stance = stand(true, now, [], taken.reading_rad)
    seen = spots(true, fixture, now, [], stance)
    assert np.abs(seen.seen_m).max() < EDGE * fixture.half_size_m + 1e-9
    assert np.abs(seen.seen_m).max() > 0.7 * fixture.half_size_m
    origin_m, rotation_rad = origin_and_rotation(fixture.psd2_in_psd1)
    faces = place_faces(
        Fixture(fixture.half_size_m, Pose(origin_m, rotation_rad)), Pose(*origin_and_rotation(fixture.places[0]))
    )
    for row, tool in enumerate(stance.T_base_tool):
        at_m = tool[:3, :3] @ fixture.laser_origin_m + tool[:3, 3]
        found = trace(Ray(*at_m, *(tool[:3, :3] @ fixture.laser_direction)), faces)
        assert found.first == taken.first_psd[row]
        assert found.psd1 is not None
        assert found.psd2 is not None
        theirs = (found.psd1.x_m, found.psd1.y_m, found.psd2.x_m, found.psd2.y_m)
        assert seen.seen_m[row] == pytest.approx(theirs, abs=1e-12)


def test_centred_shots_meet_both_centres(drawn, scene) -> None:
    true, fixture = drawn.true, drawn.true.instrument
    taken = shots(true, fixture, 1, 20, 1.0, np.random.default_rng(4))
    now = replace(scene(taken.reading_rad), first_psd=taken.first_psd)
    seen = spots(true, fixture, now, [], stand(true, now, [], taken.reading_rad))
    assert np.abs(seen.seen_m).max() < 2e-4


def test_both_orders_occur(drawn) -> None:
    taken = shots(drawn.true, drawn.true.instrument, 1, 40, 0.0, np.random.default_rng(5))
    assert set(taken.first_psd.tolist()) == {1, 2}
