"""What has no name: one finding a place, of a size that the readings show; names that only balance each other."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.assess.assessment import assessed, predicts
from calibrate.diagnose.assess.findings import findings_of, pieces
from calibrate.diagnose.assess.unknown import cancel, with_unknowns
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.open_families import anything, fitted_curve, open_families
from calibrate.diagnose.search.port_process import places_of, processes
from calibrate.diagnose.search.score import removed
from calibrate.diagnose.search.search import search
from calibrate.diagnose.search.searching import Search, holds
from calibrate.model.effects.curve import curve
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Accepted, Form, Missing, Shape
from tests.calibrate.diagnose.conftest import Plain

SIZE_RAD = 1.5


def uneven(drivers):
    """Smooth, over two joints, and nothing that a geometry could follow."""
    return np.sin(1.7 * drivers.q_rad[:, 1]) * np.cos(1.3 * drivers.q_rad[:, 3])


def wavy(drivers):
    return np.sin(3.3 * drivers.q_rad[:, 2]) + 0.5 * np.cos(4.1 * drivers.q_rad[:, 2])


def moved_by(world, rng, where, function, size):
    """A session whose joint `where` is off by size x function; the true rms there, geometry's part taken out."""
    session = world.session(rng)
    at = world.at_joint(where, function)(session.drivers)
    effect = np.einsum("nkj,nj->nk", session.lever, at)
    return world.with_readings(session, session.readings + size * effect)


def test_all_that_is_unknown_at_one_port_is_one_finding_with_its_drivers(world):
    rng = np.random.default_rng(1)
    truth = [(world.at_joint(3, wavy), 2.0), (world.at_joint(3, uneven), 2.0)]
    found = with_unknowns(search(world.session(rng, truth), rng))
    unknown = [a for a in found.state.accepted if a.term.open]
    assert len(unknown) >= 2
    said = findings_of(found, [()] * len(found.state.accepted), predicts(found.bench))
    (one,) = [f for f in said if f.name.where == "joint3.angle"]
    assert one.name.physics == "unknown"
    assert set(one.name.depends_on) >= {"q2", "q3", "q4"}
    assert one.share > 0.95
    assert sum(f.share for f in said) == pytest.approx(1.0)


def test_the_size_of_an_unknown_cause_is_what_the_readings_show(world):
    """Not that of its coefficients, which geometry and other terms share with it."""
    within = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        session = moved_by(world, rng, 3, wavy, SIZE_RAD)
        found = with_unknowns(search(session, rng))
        said = findings_of(found, [()] * len(found.state.accepted), predicts(found.bench))
        (size,) = said[0].parameters.values()
        true = SIZE_RAD * np.sqrt(np.mean(wavy(session.drivers) ** 2))
        within += 0.75 * true < size.value < 1.1 * true
        assert size.sigma < 0.2 * size.value
        assert "depends on q3: shows as" in said[0].says
    assert within == 4


@pytest.mark.parametrize(("step", "named"), [(6.0, True), (0.3, False)])
def test_a_step_beside_an_unknown_drift_keeps_its_name_where_it_is_the_greater(world, step, named):
    """A ball seated again while something creeps at the same place: no curve over time jumps."""
    rng = np.random.default_rng(6)
    session = world.session(rng)
    t = session.drivers.t_s
    slip = next(a for a in session.terms if a.physics == "encoder-slip" and a.port.where == "joint3.angle")
    creep = Plain(slip.port, ("t",), Shape.SMOOTH, "unknown", joint=2, open=True)
    middle = np.array([np.median(t)])
    at = np.zeros((len(t), 4))
    at[:, 2] = step * (t > middle[0]) + np.cos(2.0 * np.pi * t / t.max())
    moved = world.with_readings(session, session.readings + np.einsum("nkj,nj->nk", session.lever, at))
    fitted = moved.refitted([Accepted(slip, np.ones(1), middle), Accepted(creep, np.ones(6), np.zeros(0))])
    both = Search(Bench(fitted), rng)
    said = findings_of(both, [(), ()], np.ones(2))
    assert [f.name.physics for f in said] == (["encoder-slip", "unknown"] if named else ["unknown"])
    if named:
        assert said[0].confidence == pytest.approx(0.95)
        size = said[0].parameters["c0"]
        assert abs(size.value - step) < 3.0 * size.sigma


def test_names_that_balance_each_other_are_no_machine(world):
    rng = np.random.default_rng(2)
    session = world.session(rng, ranges=(3.0, 2.5, 0.35, 3.0))
    own = {t.physics: t for t in session.candidates() if t.port.where == "joint3.angle"}
    first = Accepted(own["encoder-eccentricity"], np.array([4.0, -1.0]), np.zeros(0))
    against = Accepted(own["encoder-harmonic"], _balancing(Bench(session), first, own["encoder-harmonic"]), np.zeros(0))
    also_named = Accepted(own["backlash"], np.array([1.0]), np.zeros(0))
    assert cancel(holding(session, (first, against)), (0, 1))
    assert not cancel(holding(session, (first, also_named)), (0, 1))


def _balancing(bench, first, term):
    columns = bench.state.columns(term, np.zeros(0))
    return np.linalg.lstsq(bench.sight.complement(columns.T).T, -bench.behind(first), rcond=None)[0]


def holding(session, accepted):
    """With values as given: a refit would take them apart."""
    theta = np.concatenate([session.theta, *(a.coefficients for a in accepted)])
    return Bench(replace(session, accepted=accepted, theta=theta))


def test_the_best_curve_is_the_best_of_all_curves(world):
    """The bound that spares most of the work decides nothing."""
    rng = np.random.default_rng(3)
    bench = Bench(world.session(rng, [(world.at_joint(2, uneven), 0.5)]))
    for number in (1, 2):
        every = processes(bench, places_of(bench), number)
        gains = every.gains(bench.sight.residual[:, None])[:, 0]
        all_of_them = np.ones(len(gains), dtype=bool)
        found = every.best(bench.sight.residual, all_of_them, least=-np.inf)
        assert found == (int(np.argmax(gains)), pytest.approx(gains.max()))
        barred = np.arange(len(gains)) != np.argmax(gains)
        second = every.best(bench.sight.residual, barred, least=-np.inf)
        assert second is not None
        assert second[1] == pytest.approx(np.max(gains[barred]))
        assert every.best(bench.sight.residual, all_of_them, least=float(gains.max()) + 0.1) is None


def test_a_curve_holds_slow_harmonics_of_its_own_joint_only(world):
    terms = [t for t in world.session(np.random.default_rng(5)).candidates() if not t.open]
    at_joint_2 = [t for t in terms if t.port.where == "joint2.angle" and t.depends_on == ("q2",)]
    smooth = curve(at_joint_2[0].port, 1, ("q2",), 4)
    held = [t for t in terms if holds(smooth, t)]
    assert held
    assert all(t in at_joint_2 and (t.order or 1) <= 2 for t in held)
    assert not any(holds(t, at_joint_2[0]) for t in terms)  # a name holds no other


def law(port, shape, driver, component=0, order=None):
    """One piece of physics along one direction of a port, six of a frame."""
    along = np.eye(6)[:, [component]]
    about = {"names": ("size_rad",), "limit": 1.0, "sentence": "", "directions": along}
    return Form(port, (driver,), shape, "some physics", order, function=lambda drivers, inner: drivers.q_rad, **about)


def test_a_curve_holds_no_step_and_nothing_behind_both_encoders():
    angle = Port("joint2.angle", Place.JOINTS)
    slow = law(angle, Shape.LINEAR, "t")
    assert holds(curve(angle, 1, ("t",), 4), slow)
    assert not holds(curve(angle, 1, ("t",), 4), law(angle, Shape.STEP, "t"))
    assert not holds(curve(replace(angle, past_encoders=True), 1, ("t",), 4), slow)


def test_a_curve_along_one_direction_of_a_link_holds_nothing_along_another():
    link = Port("link2.offset", Place.FRAME, 2)
    bent = law(link, Shape.HARMONIC, "q1", component=4, order=1)
    assert holds(curve(link, 4, ("q1", "q2"), 4), bent)
    assert not holds(curve(link, 3, ("q1", "q2"), 4), bent)
    assert not holds(curve(replace(link, index=3), 4, ("q1", "q2"), 4), bent)


def test_curves_of_which_geometry_leaves_nothing_explain_nothing(world):
    bench = Bench(world.session(np.random.default_rng(5), [(world.at_joint(2, uneven), 0.5)]))
    every = processes(bench, places_of(bench), 1)
    rounding = np.full_like(every.gram, -1e-18)  # all that is left of the Gram matrices
    taken = replace(every, gram=rounding, products=lambda r: 0.0 * every.products(r))
    assert taken.best(bench.sight.residual, np.ones(len(every.gram), dtype=bool)) is None


def test_terms_taken_out_come_back_into_what_a_curve_may_explain(world):
    rng = np.random.default_rng(4)
    session = world.session(rng, [(world.at_joint(3, uneven), 2.0)])
    bench = Bench(session)
    offer = open_families(bench).best(None, anything)
    held = Bench(session.refitted([fitted_curve(bench, offer, None)]))
    again = open_families(held).best(removed(held.state, held.sight, (0,)), anything)
    assert again.term.depends_on == offer.term.depends_on == ("q2", "q4")
    # Noise is smaller and no row an outlier any more: the same curve is worth more than it promised.
    assert again.gain > offer.gain


def test_unseen_errors_are_those_of_leaving_rows_out(world):
    """Against a refit without the fold."""
    from calibrate.diagnose.assess.assessment import _unseen_squares

    rng = np.random.default_rng(5)
    X, y = rng.normal(size=(60, 5)), rng.normal(size=60)
    Q, _ = np.linalg.qr(X)
    left = y - Q @ (Q.T @ y)
    total = 0.0
    for fold in np.array_split(np.arange(60), 4):
        rest = np.setdiff1d(np.arange(60), fold)
        error = y[fold] - X[fold] @ np.linalg.lstsq(X[rest], y[rest], rcond=None)[0]
        total += float(np.sum(error**2))
    found = _unseen_squares(Q, left, np.array_split(np.arange(60), 4), np.zeros((60, 0)))
    assert np.sum(found) == pytest.approx(total, rel=1e-6)


def test_what_explains_little_next_to_an_unknown_cause_is_no_final_name(world):
    rng = np.random.default_rng(6)
    truth = [(world.at_joint(3, uneven), 8.0), (world.at_joint(2, lambda d: d.approach[:, 1]), 0.8)]
    said = assessed(world.session(rng, truth), rng).findings
    assert said[0].name.physics == "unknown"
    small = [f for f in said if f.name.physics == "backlash"]
    assert small
    assert all(f.confidence <= 0.5 for f in small)


def test_a_curve_over_drivers_that_an_open_term_has_is_not_added_next_to_it(world):
    rng = np.random.default_rng(7)
    found = with_unknowns(search(world.session(rng, [(world.at_joint(3, wavy), 4.0)]), rng))
    drivers = [a.term.depends_on for a in found.state.accepted if a.term.open and a.term.port.where == "joint3.angle"]
    assert len(drivers) == len(set(drivers)) == 1
    port = found.state.accepted[0].term.port
    assert curve(port, 2, ("q3",), 4).key == curve(port, 2, ("q3",), 9).key


def test_three_functions_of_the_pose_at_one_joint_of_a_sound_machine_are_no_names(world):
    at_3 = [t for t in world.session(np.random.default_rng(8)).candidates() if t.port.where == "joint3.angle"]
    of_pose = [t for t in at_3 if not t.open and t.depends_on[0].startswith("q")][:3]
    other = [t for t in at_3 if t.physics == "backlash"]
    three = [Accepted(t, np.zeros(1), np.zeros(0)) for t in of_pose]
    assert pieces(three, places=12) == [(0, 1, 2)]
    assert pieces(three[:2] + [Accepted(t, np.zeros(1), np.zeros(0)) for t in other], places=12) == []


def test_where_faults_are_everywhere_three_may_meet_at_a_joint(world):
    names = [t for t in world.session(np.random.default_rng(8)).candidates() if not t.open and "t" not in t.depends_on]
    at_3 = [t for t in names if t.port.where == "joint3.angle" and t.depends_on[0].startswith("q")][:3]
    others = [t for t in names if t.port.where != "joint3.angle" and t.depends_on[0].startswith("approach")] * 5
    assert pieces([Accepted(t, np.zeros(1), np.zeros(0)) for t in (*at_3, *others)], places=12) == []


def test_a_name_on_the_driver_of_an_unknown_cause_is_not_final(world):
    """What nobody knows need not act through one port only."""
    rng = np.random.default_rng(9)
    truth = [(world.at_joint(3, lambda d: np.tanh(d.q_rad[:, 1] * d.q_rad[:, 2])), 4.0)]
    truth.append((world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1] + 0.4)), 3.0))
    said = assessed(world.session(rng, truth), rng).findings
    assert said[0].name.physics == "unknown"
    also_named = [f for f in said if f.name.physics == "encoder-eccentricity"]
    assert also_named
    assert all(f.confidence <= 0.5 for f in also_named)


def weighed(joint):
    port = Port(f"joint{joint}.angle", Place.JOINTS)
    return Plain(port, (f"gravity_torque{joint}",), Shape.LINEAR, "joint-compliance", joint=joint - 1)


@pytest.fixture
def without_masses(monkeypatch):
    """The linear sessions have no rig to compute a torque, its sigma or a payload's lever from."""
    monkeypatch.setattr("calibrate.diagnose.assess.assessment.unrecorded", lambda bench, rng, missing: None)
    monkeypatch.setattr("calibrate.diagnose.assess.findings.sizes_of", lambda bench, i: {})
    monkeypatch.setattr(
        "calibrate.diagnose.assess.pulled_back.likely_torque_nm", lambda d, joint: d.extra[f"gravity_torque{joint}"]
    )


def two_soft_joints(world):
    rng = np.random.default_rng(3)
    torque = {f"gravity_torque{i}": rng.normal(size=world.samples) for i in (2, 4)}
    truth = [(world.at_joint(i, lambda d, i=i: torque[f"gravity_torque{i}"]), enr) for i, enr in ((2, 6.0), (4, 1.5))]
    session = world.session(rng, truth, extra=torque)
    return replace(session, terms=(*session.terms, weighed(2), weighed(4))), rng


@pytest.mark.parametrize(
    ("lacking", "sure"),
    [
        ((), {"joint2.angle", "joint4.angle"}),
        ((Missing("payload", "payload_kg", "payload-compliance"),), {"joint2.angle"}),
        ((Missing("gravity_torque", "mass_kg", "joint-compliance"),), {"joint2.angle"}),
    ],
)
def test_next_to_a_great_cause_by_weight_a_slight_one_is_final_only_if_all_weights_are_known(
    world, without_masses, lacking, sure
):
    session, rng = two_soft_joints(world)
    said = assessed(session, rng, lacking).findings
    assert {f.name.where for f in said if f.name.physics == "joint-compliance"} == {"joint2.angle", "joint4.angle"}
    assert {f.name.where for f in said if f.confidence > 0.5} == sure


def test_a_weight_is_a_function_of_the_angles_of_an_unknown_cause_at_its_joint(world, without_masses):
    """The load that turns a joint may be one that is not recorded."""
    rng = np.random.default_rng(3)
    torque = {"gravity_torque2": rng.normal(size=world.samples)}
    truth = [(world.at_joint(2, lambda d: np.tanh(3.0 * d.q_rad[:, 0] * d.q_rad[:, 2])), 4.0)]
    truth.append((world.at_joint(2, lambda d: torque["gravity_torque2"]), 4.0))
    session = world.session(rng, truth, extra=torque)
    said = assessed(replace(session, terms=(*session.terms, weighed(2))), rng).findings
    assert {f.name.physics for f in said} == {"unknown", "joint-compliance"}
    assert all(f.confidence <= 0.5 for f in said if f.name.physics == "joint-compliance")


def test_a_slight_law_of_the_angle_next_to_a_great_cause_by_weight_is_no_final_name(world, without_masses):
    """Weights are never stated exactly."""
    rng = np.random.default_rng(3)
    torque = {"gravity_torque2": rng.normal(size=world.samples)}
    truth = [(world.at_joint(2, lambda d: torque["gravity_torque2"]), 9.0)]
    truth += [(world.at_joint(joint, lambda d, i=joint: np.sin(d.q_rad[:, i - 1])), 1.2) for joint in (2, 3)]
    session = world.session(rng, truth, extra=torque)
    said = assessed(replace(session, terms=(*session.terms, weighed(2))), rng).findings
    sure = {f.name.where: f.confidence > 0.5 for f in said if f.name.physics == "encoder-eccentricity"}
    assert sure == {"joint2.angle": False, "joint3.angle": True}
