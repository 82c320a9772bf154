"""Mechanisms at work in the moving world show the detectors what the fast path says of the same poses."""

import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from simulators.conceal.observe import observe
from simulators.conceal.on_wire import rig_of_world
from simulators.conceal.poses import shots
from simulators.conceal.rig import TrueRig
from simulators.defects import MECHANISMS, Defect, Scene, Site, WrittenError, defects_of, written
from simulators.world.moving_mechanisms import temperatures
from simulators.world.rig import read_rig
from simulators.world.truth import draw_truth
from simulators.world.world import World

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
SEED = 5
SETTLED_S = 1.0
UNSEEN = {"outside-fan"}  # needs a fan: the emulated rig has none
SHOWN = [kind for kind in MECHANISMS if "dual-psd" in kind.INSTRUMENTS and kind.KIND not in UNSEEN]
# Both make the same poses of the same mechanics; what is left is rounding, and a load that leaves out its own bend.
AGREE_M = 1e-8
SITE = Site(
    n_joints=6,
    instrument="dual-psd",
    loaded=(2, 3, 4, 5),
    torque_nm=(0.0, 20.0, 10.0, 2.0, 0.5, 0.0),
    gear_ratio=(101.0,) * 6,
    link_length_m=(0.0, 0.16, 0.425, 0.392, 0.13, 0.1, 0.1),
    sweep_rad=(1.0,) * 6,
    usual_rad=((-1.0, 1.0),) * 6,
    places=(1,),
    stays_s=((1, 0.0, 4.0),),
    seats=(),
    half_size_m=0.01,
    duration_s=4.0,
)


def drawn(kind: type[Defect]) -> Defect:
    return kind.draw(np.random.default_rng(3), SITE)


@pytest.fixture(scope="module")
def plain() -> dict:
    rig = tomllib.loads(RIG.read_text())
    rig["emulation"]["joint_repeatability_rad"] = 0.0
    return rig


@pytest.fixture(scope="module")
def true(plain: dict) -> TrueRig:
    rig = read_rig(plain)
    return rig_of_world(rig, draw_truth(rig, SEED), plain)


@pytest.fixture(scope="module")
def poses_rad(true: TrueRig) -> np.ndarray:
    """One that lights both faces, with a start beside it, and the nearest other one: short ways are soon stepped."""
    lit = shots(true, true.instrument, 1, 60, 0.0, np.random.default_rng(2)).reading_rad
    far = np.max(np.abs(lit - lit[0]), axis=1)
    return np.vstack([lit[0] - 0.05, lit[np.argsort(far)[:2]]])


def shown(plain: dict, hidden: Sequence[Defect], poses_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spots (pose, 4) as a detector without noise says them, when, and the face struck first."""
    world = World.from_rig(plain, seed=SEED, q_rad=poses_rad[0], hidden=hidden)
    rows, at_s, first = [], [], []
    for q_rad in poses_rad[1:]:
        world.command(q_rad)
        world.advance(world.time_s + SETTLED_S)
        world.advance(world.time_s + 0.3)
        spots = world.spots()
        assert world.joints().q_rad == pytest.approx(q_rad, abs=1e-10)
        rows.append([spots.psd1.x_m, spots.psd1.y_m, spots.psd2.x_m, spots.psd2.y_m])
        at_s.append(world.time_s)
        first.append(spots.first)
    return np.array(rows), np.array(at_s), np.array(first)


def said(
    true: TrueRig, hidden: Sequence[Defect], poses_rad: np.ndarray, at_s: np.ndarray, first: np.ndarray
) -> np.ndarray:
    """The same by the fast path."""
    rows, n = poses_rad.shape
    t_s = np.append(0.0, at_s)
    scene = Scene(
        t_s=t_s,
        via_rad=np.vstack([poses_rad[:1], poses_rad[:-1]]),
        goal_rad=poses_rad,
        qd_rad_s=np.zeros((rows, n)),
        wait_s=np.ones(rows),
        payload_kg=np.zeros(rows),
        payload_com_m=np.zeros(3),
        placement=np.ones(rows, dtype=np.int64),
        first_psd=np.append(first[0], first),
        seat=np.zeros(rows, dtype=np.int64),
        temperature_degC=temperatures(t_s, n),
        laser_power=np.ones(rows),
        extra={},
    )
    return observe(true, scene, hidden, poses_rad).values_m[1:]


@pytest.mark.parametrize("kind", SHOWN, ids=lambda kind: kind.KIND)
def test_the_world_shows_what_the_fast_path_says(
    kind: type[Defect], plain: dict, true: TrueRig, poses_rad: np.ndarray
) -> None:
    hidden = [drawn(kind)]
    seen_m, at_s, first = shown(plain, hidden, poses_rad)
    assert seen_m == pytest.approx(said(true, hidden, poses_rad, at_s, first), abs=AGREE_M)


def test_nothing_hidden_changes_nothing(plain: dict, true: TrueRig, poses_rad: np.ndarray) -> None:
    seen_m, at_s, first = shown(plain, (), poses_rad)
    assert seen_m == pytest.approx(said(true, (), poses_rad, at_s, first), abs=1e-12)


def test_a_hidden_mechanism_is_seen_far_beyond_what_the_two_paths_differ(
    plain: dict, true: TrueRig, poses_rad: np.ndarray
) -> None:
    """So that the agreement above is one about the mechanisms."""
    moved_m = []
    for kind in SHOWN:
        at_s, first = np.array([2.3, 4.6]), np.array([1, 1])
        off_m = said(true, [drawn(kind)], poses_rad, at_s, first) - said(true, (), poses_rad, at_s, first)
        moved_m.append(float(np.abs(off_m).max()))
    assert np.mean(np.array(moved_m) > 20.0 * AGREE_M) > 0.75


@pytest.mark.parametrize("kind", SHOWN, ids=lambda kind: kind.KIND)
def test_what_is_written_comes_back(kind: type[Defect]) -> None:
    assert defects_of(written([drawn(kind)])) == (drawn(kind),)


def test_what_is_no_mechanism_is_refused() -> None:
    with pytest.raises(WrittenError, match="no mechanism 'gremlin'; there are encoder-eccentricity"):
        defects_of([{"mechanism": "gremlin"}])
    with pytest.raises(WrittenError, match=r"soft-joint.*compliance"):
        defects_of([{"mechanism": "soft-joint", "fields": {"joint": 2}}])
