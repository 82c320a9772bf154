"""What single entries add, against mechanics worked out another way."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from calibrate.diagnose.state.visible import grid_of
from calibrate.model.effects import time_laws
from calibrate.model.effects.arm_thermal_growth import EFFECT as ARM_GROWTH
from calibrate.model.effects.backlash import EFFECT as BACKLASH
from calibrate.model.effects.base_moved import EFFECT as BASE_MOVED
from calibrate.model.effects.curves import bumps, splines
from calibrate.model.effects.encoder_eccentricity import EFFECT as ECCENTRICITY
from calibrate.model.effects.fixture_moved import ONE_BODY
from calibrate.model.effects.gravity import gravity_in_flange, likely_torque_nm, masses
from calibrate.model.effects.laser_moved import EFFECT as LASER_MOVED
from calibrate.model.effects.link_bending import EFFECT as BENDING
from calibrate.model.effects.link_thermal_growth import EFFECT as LINK_GROWTH
from calibrate.model.effects.open_at_readouts import EFFECT as READOUTS
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.reading_lag import EFFECT as LAG
from calibrate.model.effects.seat_moved import EFFECT as SEAT_MOVED
from calibrate.model.effects.term import Shape, Size
from calibrate.model.effects.tool_sag import EFFECT as SAG
from calibrate.model.with_effects.ported_chain import perturbed_frames
from tests.calibrate.model.effects.conftest import full_session

NOTHING = np.zeros(0)


def test_an_encoder_off_centre_reads_by_the_exact_formula():
    drivers, e, f = full_session("tracker").drivers, 0.05, 0.7
    term = ECCENTRICITY.terms(drivers)[2]
    q = drivers.q_rad[:, 2]
    amount = term.amount(drivers, np.array([-e * np.cos(f), e * np.sin(f)]), NOTHING)
    assert amount[:, 2] == pytest.approx(-np.arctan2(e * np.sin(q - f), 1.0 + e * np.cos(q - f)), abs=1e-15)
    assert not np.any(np.delete(amount, 2, axis=1))


def test_a_bending_link_is_an_elastic_line():
    """Slope and sag of the end by summing curvature along the link in 2000 pieces, for all weight behind it."""
    drivers, c, pieces = full_session("tracker").drivers, 2e-6, 2000
    term = BENDING.terms(drivers)[0]
    link, pose = int(term.port.where[4 : term.port.where.index(".")]), 17
    B = drivers.frames[pose]
    start, end = B[link - 1, :3, 3], B[link, :3, 3]
    along = (end - start) / np.linalg.norm(end - start)
    slope, sag = np.zeros(3), np.zeros(3)
    for share in (np.arange(pieces) + 0.5) / pieces:
        at = start + share * (end - start)
        moment = np.zeros(3)
        for mass, i, com in masses(drivers):
            if i > link:
                moment += np.cross(B[i, :3, :3] @ np.array(com) + B[i, :3, 3] - at, mass * drivers.gravity_m_s2)
        if drivers.payload_kg is not None:
            moment += np.cross(B[-1, :3, 3] - at, drivers.payload_kg[pose] * drivers.gravity_m_s2)
        curvature = c / pieces * (moment - (moment @ along) * along)
        slope += curvature
        sag += np.cross(curvature, end - at)
    twist = term.amount(drivers, np.array([c]), NOTHING)[pose]
    assert B[link, :3, :3] @ twist[3:] == pytest.approx(slope, rel=1e-4, abs=1e-12)
    assert B[link, :3, :3] @ twist[:3] == pytest.approx(sag, rel=1e-4, abs=1e-12)


def test_a_warm_arm_keeps_its_angles_and_scales_its_reach():
    fitted = full_session("tracker")
    drivers, growth = fitted.drivers, 1e-5
    term = next(t for t in ARM_GROWTH.terms(drivers) if t.depends_on == ("temp_room",))
    none = Perturbation.none(len(drivers.t_s), drivers.n_joints)
    theta = fitted.geometry[: len(fitted.session.arm.parameters)]
    warm = none.plus(term.port, term.amount(drivers, np.array([growth]), NOTHING))
    before = perturbed_frames(fitted.session.arm, theta, drivers.q_rad, none)
    after = perturbed_frames(fitted.session.arm, theta, drivers.q_rad, warm)
    T = drivers.temperatures_degC["room"]
    reach = before[:, -1, :3, 3] - before[:, 0, :3, 3]
    assert after[:, -1, :3, :3] == pytest.approx(before[:, -1, :3, :3], abs=1e-12)
    assert after[:, -1, :3, 3] - before[:, -1, :3, 3] == pytest.approx(
        growth * (T - T.mean())[:, None] * reach, abs=1e-12
    )


def test_a_soft_bracket_lowers_its_tip():
    """A tip on its overhang never rises under its own weight, and most where the overhang lies level."""
    drivers = full_session("tracker").drivers
    term = next(t for t in SAG.terms(drivers) if t.variant == "bracket, overhang to its tip")
    tip = np.array(drivers.rig.tool.point_m)
    turn = term.amount(drivers, np.array([1e-4]), NOTHING)[:, 3:]
    g = gravity_in_flange(drivers)
    fall = np.einsum("ni,ni->n", np.cross(turn, tip), g)
    level = np.linalg.norm(np.cross(tip / np.linalg.norm(tip), g), axis=1)
    assert fall == pytest.approx(1e-4 * np.linalg.norm(tip) * level**2, abs=1e-12)


def test_an_approach_that_is_derived_is_called_hysteresis():
    drivers = full_session("tracker").drivers
    shapes = {d: {t.shape for t in BACKLASH.terms(replace(drivers, approach_derived=d))} for d in (False, True)}
    assert Shape.HYSTERESIS not in shapes[False]
    assert Shape.HYSTERESIS in shapes[True]


def test_flanks_do_not_overlap():
    for term in BACKLASH.terms(full_session("tracker").drivers):
        inner = np.array([spec.grid[0] for spec in term.inner])
        assert term.plausible(np.array([3e-5]), inner, 1e-6)
        assert not term.plausible(np.array([-3e-5]), inner, 1e-6)


def test_gravity_turns_no_slack_over_about_an_upright_axis():
    """The foot is 5 mrad off level: the moment about joint 1 has both signs, and no flank follows it."""
    drivers = full_session("tracker").drivers
    arm = drivers.rig.arm
    tilted = replace(
        drivers, rig=structs.replace(drivers.rig, arm=structs.replace(arm, gravity_m_s2=(0.05, 0.0, -9.81)))
    )
    assert np.ptp(np.sign(likely_torque_nm(tilted, 1))) == 2.0
    by_gravity = {t.port.where for t in BACKLASH.terms(tilted) if t.depends_on[0].startswith("gravity_torque")}
    assert "joint1.angle" not in by_gravity
    assert by_gravity


@pytest.mark.parametrize(
    ("driver", "share", "says"),
    [
        ("last_move2", 0.04, "Joint 2 stops short by 4.00 ± 0.10% of its last move"),
        ("last_move2", -0.04, "The reading of joint 2 is behind the joint by 4.00 ± 0.10% of its last move"),
        (
            "cmd_minus_q2",
            0.04,
            "The reading of joint 2 is behind the joint by 4.00 ± 0.10% of what it was still asked to go",
        ),
        ("cmd_minus_q2", -0.04, "Joint 2 is behind its reading by 4.00 ± 0.10% of what it was still asked to go"),
    ],
)
def test_a_lag_says_what_is_behind_what(driver, share, says):
    term = next(t for t in LAG.terms(full_session("tracker").drivers) if t.depends_on == (driver,))
    assert term.says({"lag_share": Size(share, 1e-3)}) == says


def test_bent_light_falls_along_gravity_by_the_square_of_the_level_range():
    drivers = full_session("tracker").drivers
    term = next(t for t in READOUTS.terms(drivers) if t.variant == "towards gravity")
    bend = term.basis(drivers, NOTHING)[:, :3, 0]
    size = np.linalg.norm(bend, axis=1)
    down = bend / size[:, None]
    assert down == pytest.approx(np.broadcast_to(down[0], down.shape), abs=1e-12)
    seen = drivers.readouts["position"].predicted
    level = np.linalg.norm(seen - np.outer(seen @ down[0], down[0]), axis=1)
    assert size == pytest.approx(level**2 / 2.0)


def test_light_does_not_bend_where_targets_on_a_line_leave_the_device_s_tilt_open():
    drivers = full_session("tracker").drivers
    where = drivers.readouts["position"]
    two = replace(where, seen=np.arange(len(where.seen)) < 2)
    drivers = replace(drivers, readouts={"position": two})
    term = next(t for t in READOUTS.terms(drivers) if t.variant == "towards gravity")
    assert not np.any(term.basis(drivers, NOTHING))


def test_splines_and_a_constant_span_every_cubic():
    x = np.linspace(-2.0, 1.0, 200)
    columns = np.concatenate([splines(full_session("tracker").drivers, x), np.ones((200, 1))], axis=1)
    cubic = 1.0 - 2.0 * x + 0.5 * x**3
    assert columns @ np.linalg.lstsq(columns, cubic)[0] == pytest.approx(cubic, abs=1e-10)


def test_a_bump_is_one_at_its_place_and_gone_four_widths_off():
    assert bumps(np.array([0.3, 0.7]), np.array([0.3, 0.1]))[:, 0] == pytest.approx([1.0, np.exp(-8.0)])


def brief(effect, drivers, variant=time_laws.FOR_A_WHILE):
    return next(term for term in effect.terms(drivers) if term.variant == variant)


@pytest.mark.parametrize(("effect", "family"), [(BASE_MOVED, "cones"), (LASER_MOVED, "dual-psd")])
def test_what_is_put_back_is_at_another_place_between_two_times_only(effect, family):
    drivers = full_session(family).drivers
    term, t = brief(effect, drivers), np.sort(drivers.t_s)
    moved = np.any(term.basis(drivers, (t[[39, 79]] + t[[40, 80]]) / 2.0) != 0.0, axis=(1, 2))
    assert np.array_equal(np.sort(drivers.t_s[moved]), t[40:80])
    sizes = {name: Size(1e-5, 1e-6) for name in term.names}
    says = term.says(sizes | {"time_s": Size(30.0, 1.0), "until_s": Size(75.0, 2.0)})
    assert "from 30.0 ± 1.0 s on, until 75.0 ± 2.0 s" in says


def test_three_shots_are_no_state():
    drivers = full_session("cones").drivers
    term, t = brief(BASE_MOVED, drivers), np.sort(drivers.t_s)
    between = (t[:-1] + t[1:]) / 2.0
    assert not np.any(term.basis(drivers, between[[39, 42]]))
    assert np.any(term.basis(drivers, between[[39, 43]]))


def test_an_end_is_sought_after_its_begin():
    drivers = full_session("cones").drivers
    for variant in (time_laws.FOR_A_WHILE, *(f"{what}, {time_laws.FOR_A_WHILE}" for what in (ONE_BODY, "seat 2"))):
        term = brief(BASE_MOVED if variant == time_laws.FOR_A_WHILE else SEAT_MOVED, drivers, variant)
        pairs = np.array(grid_of(term))
        assert np.all(pairs[:, 0] < pairs[:, 1])
        assert all(np.any(term.basis(drivers, pair)) for pair in pairs)


def test_a_plate_with_all_cones_moves_as_what_stands_around_a_base():
    drivers = full_session("cones").drivers
    plate = brief(SEAT_MOVED, drivers, ONE_BODY)
    base = next(t for t in BASE_MOVED.terms(drivers) if t.shape is Shape.STEP and not t.variant)
    at, seen = np.array([np.median(drivers.t_s)]), drivers.readouts["seat"].seen
    assert np.array_equal(plate.basis(drivers, at)[seen], base.basis(drivers, at)[seen])
    assert not np.any(plate.basis(drivers, at)[~seen])


def test_a_link_behind_its_thermometer_trails_a_ramp_and_ends_on_it():
    """A ramp of T is followed at the distance rate x lag (1 - exp(-t / lag)); a link without a lag is as warm as it."""
    plain = full_session("tracker").drivers
    t = plain.t_s - plain.t_s.min()
    drivers, lag_s = replace(plain, temperatures_degC={"link2": 20.0 + 2e-3 * t}), 0.2 * np.ptp(t)
    terms = [term for term in LINK_GROWTH.terms(drivers) if term.port.where == "link2.length"]
    at_once, trailing = (next(term for term in terms if term.variant == v) for v in ("", time_laws.BEHIND))
    apart = (at_once.basis(drivers, NOTHING) - trailing.basis(drivers, np.array([lag_s])))[:, :3, 0]
    span = at_once.basis(drivers, NOTHING)[:, :3, 0] / (2e-3 * (t - t.mean()))[:, None]
    law = 2e-3 * lag_s * -np.expm1(-t / lag_s)
    assert apart == pytest.approx(law[:, None] * span, abs=1e-9)
    soon = trailing.basis(drivers, np.array([1e-3 * lag_s]))
    assert soon == pytest.approx(at_once.basis(drivers, NOTHING), abs=1e-3 * np.ptp(t) * 2e-3)


def test_no_link_is_behind_a_thermometer_that_was_not_recorded():
    drivers = replace(full_session("tracker").drivers, temperatures_degC={})
    assert time_laws.BEHIND not in {term.variant for term in LINK_GROWTH.terms(drivers)}
