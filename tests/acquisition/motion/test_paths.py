"""Paths are continuous in position, speed and acceleration whatever they are made of, and end where they should."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acquisition.errors import RefusedMotionError
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import apart, inverse, transform
from acquisition.motion.paths.legs import drive_between
from acquisition.motion.paths.path import BeltState, Path
from acquisition.motion.paths.segments import BlendState, By, Pace, Place, Segment, blend
from tests.acquisition.motion.conftest import ur5e
from tests.acquisition.motion.continuity import jumps

ARM = ur5e(1e-3)
SOLVER = Solver(ARM, closed_form(ur5e()))
HOME_RAD = np.array([0.3, -1.4, 1.6, -0.5, 1.3, 0.1])  # well away from where the wrist is singular
PACE = Pace(np.full(6, 1.0), np.full(6, 6.0))
RATE_M_S = 0.08
VECTOR = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
# Position to 0.1 um and urad; speed and acceleration to what six samples 3 ms apart can tell of a smooth curve.
SMOOTH = np.array([1e-7, 1e-5, 5e-3])


def coord(s_m: float) -> np.ndarray:
    return transform((0.1 + s_m * 0.6, s_m * 0.8, 0.05), (0.0, 0.0, 0.4))


def place_at(shift, turn, tool, *, moving: bool, s0_m: float = 0.0) -> Place:
    """Near home, with the belt at s0."""
    T_flange_tool = transform(0.1 * np.array(tool), 0.5 * np.array(tool))
    wanted = SOLVER.flange(HOME_RAD) @ transform(0.12 * np.array(shift), 0.4 * np.array(turn)) @ T_flange_tool
    if not moving:
        return Place("fixed", wanted, T_flange_tool)
    return Place("carried", inverse(coord(s0_m)) @ wanted, T_flange_tool, coord)


def belt_at(t_s: float) -> BeltState:
    return BeltState(RATE_M_S * t_s, RATE_M_S)


def run(segments, step_s: float = 0.05) -> Path:
    """A path gone through to its end."""
    path = Path(SOLVER, HOME_RAD, segments, PACE)
    t_s = 0.0
    while t_s < path.ends_s:
        path.at(t_s, belt_at(t_s))
        t_s += step_s
    return path


def forwards(path: Path):
    """The path as a function of time that goes its way in small steps, as a stream would."""
    reached_s = [0.0]

    def at(t_s: float) -> np.ndarray:
        for t in np.arange(reached_s[0], t_s, 0.04):
            path.at(float(t), belt_at(float(t)))
        reached_s[0] = t_s
        return path.at(t_s, belt_at(t_s))

    return at


@pytest.mark.parametrize("seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.endure) for seed in range(6, 12))])
def test_random_programs_never_jump(seed: int) -> None:
    """Joint and straight, fixed and moving, with tools of their own, in any order."""
    rng = np.random.default_rng(seed)
    segments = []
    for i in range(4):
        shift, turn, tool = rng.uniform(-1.0, 1.0, (3, 3))
        by, moving = rng.choice([By.JOINTS, By.LINE]), bool(rng.integers(2))
        segments.append(Segment(f"{i}", by, place_at(shift, turn, tool, moving=moving, s0_m=0.1)))
    corners = run(segments).corners_s
    path = Path(SOLVER, HOME_RAD, segments, PACE)
    moments = np.unique(np.round([c + side * path.tacc_s for c in corners for side in (-1.0, 1.0)], 9))
    moments = moments[np.diff(moments, prepend=-1.0) > 0.05]  # transitions that meet are one moment
    found = jumps(forwards(path), moments)
    assert (found.max(axis=0) < SMOOTH).all(), found


def test_a_path_whose_speed_jumps_is_reported() -> None:
    """The same judge on a path without transitions, and on one whose transition has no matching acceleration."""
    sharp = lambda t: np.array([abs(t - 1.0)])  # noqa: E731
    parabola = lambda t: np.array([0.0 if t < 1.0 else 3.0 * (t - 1.0) ** 2])  # noqa: E731
    assert jumps(sharp, [1.0])[0, 1] == pytest.approx(2.0)
    found = jumps(parabola, [1.0])[0]
    assert (found > SMOOTH).tolist() == [False, False, True]


def test_a_path_without_its_transition_fails_the_same_judge(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm is thrown from one leg onto the next at the corner: what random programs are judged by must see it."""
    corner = place_at((0.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), moving=False)
    away = place_at((0.8, 0.8, 0.0), (0.2, 0.0, 0.0), (0.0, 0.0, 0.0), moving=False)
    segments = [Segment("a", By.LINE, corner), Segment("b", By.LINE, away)]
    made = run(segments)
    moments = [made.corners_s[1] - made.tacc_s, made.corners_s[1] + made.tacc_s]
    assert (jumps(forwards(Path(SOLVER, HOME_RAD, segments, PACE)), moments).max(axis=0) < SMOOTH).all()
    monkeypatch.setattr(Path, "blending", lambda self, t_s: False)
    found = jumps(forwards(Path(SOLVER, HOME_RAD, segments, PACE)), moments)
    assert found[:, 0].max() > 100.0 * SMOOTH[0]
    assert found[:, 1].max() > 100.0 * SMOOTH[1]


def test_the_transition_of_straight_segments_is_the_quartic_of_the_source() -> None:
    A, B, C, tacc, T = np.array([0.3, -0.1]), np.array([0.5, 0.2]), np.array([0.1, 0.9]), 0.2, 1.3
    dC, dB, zero = C - B, A - B, np.zeros(2)
    curve = blend(-tacc, BlendState(A, -dB / tacc, zero), tacc, BlendState(B + dC * tacc / T, dC / T, zero))
    for t in np.linspace(-tacc, tacc, 9):
        h = (t + tacc) / (2.0 * tacc)
        quartic = ((dC * tacc / T + dB) * (2.0 - h) * h**2 - 2.0 * dB) * h + B + dB
        np.testing.assert_allclose(curve.at(t), quartic, atol=1e-14)
        step = 1e-5
        slope = (curve.at(t + step) - curve.at(t - step)) / (2.0 * step)
        np.testing.assert_allclose(slope, ((dC * tacc / T + dB) * (1.5 - h) * 2.0 * h**2 - dB) / tacc, atol=1e-8)


@given(VECTOR, VECTOR, VECTOR, VECTOR)
@settings(max_examples=50, deadline=None)
def test_the_drive_leads_from_one_pose_to_the_other_on_a_straight_line(p1, r1, p2, r2) -> None:
    P1, P2 = transform(p1, r1), transform(p2, np.array(r2) * 1.7)
    drive = drive_between(P1, P2)
    np.testing.assert_allclose(P1 @ drive.at(0.0), P1, atol=1e-12)
    np.testing.assert_allclose(P1 @ drive.at(1.0), P2, atol=1e-7)  # atan2 of a nearly straight approach vector
    middle = (P1 @ drive.at(0.5))[:3, 3]
    np.testing.assert_allclose(middle, 0.5 * (np.array(p1) + np.array(p2)), atol=1e-12)


@pytest.mark.parametrize("by", [By.JOINTS, By.LINE])
@pytest.mark.parametrize("moving", [False, True])
def test_a_path_comes_to_rest_on_its_end_also_on_a_belt(by: By, moving: bool) -> None:
    place = place_at((0.5, -0.8, 0.3), (0.2, 0.7, -0.4), (0.1, 0.2, 0.5), moving=moving, s0_m=0.1)
    path = run([Segment("go", by, place)])
    end_s = path.ends_s
    for t_s in (end_s, end_s + 0.5):
        off_m, off_rad = apart(SOLVER.flange(path.at(t_s, belt_at(t_s))), place.flange_at(belt_at(t_s).s_m))
        assert off_m < 1e-9
        assert off_rad < 1e-9


def test_a_straight_line_is_straight_between_its_transitions() -> None:
    first = place_at((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.5), moving=False)
    last = replace(first, pos=first.pos @ transform((0.15, 0.1, 0.0)))
    segments = [Segment("a", By.LINE, first), Segment("b", By.LINE, last)]
    corners = run(segments).corners_s
    path = Path(SOLVER, HOME_RAD, segments, PACE)
    tips = [SOLVER.flange(path.at(t)) @ first.tool for t in np.linspace(0.0, run(segments).ends_s, 200)]
    from_a = np.array([(inverse(first.pos) @ T)[:3, 3] for T in tips])
    direction = np.array([0.15, 0.1, 0.0]) / np.hypot(0.15, 0.1)
    off = from_a - np.outer(from_a @ direction, direction)
    assert len(corners) == 3
    assert np.abs(off).max() < 1e-6  # home is the first place: all of it lies on the line


def test_a_corner_is_missed_and_a_stand_is_not() -> None:
    corner = place_at((0.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), moving=False)
    away = place_at((0.8, 0.8, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), moving=False)
    past = nearest_m([Segment("a", By.LINE, corner), Segment("b", By.LINE, away)], corner)
    stop = Segment("hold", By.STAND, corner, time_s=0.2, action="GRASP")
    onto = nearest_m([Segment("a", By.LINE, corner), stop, Segment("b", By.LINE, away)], corner)
    assert past > 1e-3
    assert onto < 1e-8


def nearest_m(segments, place: Place) -> float:
    path = Path(SOLVER, HOME_RAD, segments, PACE)
    times, best = np.arange(0.0, run(segments).ends_s, 0.01), np.inf
    for t_s in times:
        best = min(best, apart(SOLVER.flange(path.at(t_s)), place.flange_at(0.0))[0])
    return best


def test_what_is_out_of_reach_is_refused_with_segment_and_joint() -> None:
    far = Place("far", transform((1.5, 0.0, 0.3)), np.eye(4))
    with pytest.raises(RefusedMotionError, match=r"segment 1 'go' \(joint\).*out of reach"):
        run([Segment("go", By.JOINTS, far)])
    with pytest.raises(RefusedMotionError, match=r"segment 1 'go' \(line\).*joint \d hardly moves the flange"):
        run([Segment("go", By.LINE, far)])
