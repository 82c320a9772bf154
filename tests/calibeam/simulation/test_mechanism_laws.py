"""Every effect of the catalogue against the mechanism that it becomes: both change the readings alike.

The exceptions and their reasons are those of the table itself (calibeam/simulation/mechanism_table.py, `within`).
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.samples import ORIENTATION, POSITION
from calibeam.simulation.found import FoundEffect, FoundIn
from calibeam.simulation.mechanism_table import TABLE, counterpart_of, mechanism_of
from calibeam.simulation.rig_in_numbers import rigged
from calibeam.simulation.scene_of_samples import Clock, scene_of
from calibrate.fit.identify.session import about_of
from calibrate.model.effects.catalogue import terms_of
from calibrate.model.effects.drivers import Readout
from calibrate.model.effects.fixture_moved import ONE_BODY
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.second_encoders import PLACES
from calibrate.model.effects.term import Shape, Term
from calibrate.model.predict import Predictor, readings
from calibrate.model.sensors.camera import PLACE, TURN
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.with_effects.acting import moved_columns
from calibrate.model.with_effects.ported_chain import perturbed_frames
from simulators.conceal.case import conceal
from simulators.conceal.rig_file import rig_document, toml_text
from simulators.conceal.wanted import FAMILIES, Family
from simulators.defects import Scene
from simulators.replayed import Readings, Rigged, Sited, replayed
from tests.calibrate.model.effects.conftest import full_session, wanted

SIZE = 5e-5  # rad or m at a port: what a machine shows


def rig_text_of(family: Family, *, in_turns: bool = False) -> str:
    """The rig file of that session."""
    return toml_text(rig_document(conceal(wanted(family, in_turns=in_turns)).stated))


class Bench:
    """One session of a family, as both sides see it."""

    def __init__(self, family: Family, *, in_turns: bool) -> None:
        fit = full_session(family, in_turns=in_turns)
        self.rig_text = rig_text_of(family, in_turns=in_turns)
        self.drivers, self.samples = fit.drivers, fit.session.samples
        values = {p.name: float(v) for p, v in zip(fit.session.parameters, fit.geometry, strict=True)}
        names = tuple(m.name for m in fit.session.measured)
        self.predictor = Predictor(fit.session.rig, values, about_of(fit.session.weighting), names)
        self.session = FoundIn.of(self.predictor, self.drivers)
        rest = {place: float(degC.mean()) for place, degC in self.drivers.temperatures_degC.items()}
        clock = Clock(float(self.drivers.t_s.min()), float(self.drivers.t_s.max()), rest)
        self.scene: Scene = scene_of(self.samples, clock, same_recording=True)
        self.rig: Rigged = rigged(self.predictor, self.samples)
        self.plain = self.simulated(())
        self.expected = self.modelled(self.samples.joints(), Perturbation.none(len(self.samples), 6))

    def simulated(self, mechanisms: tuple[Sited, ...]) -> Readings:
        return replayed(self.rig, self.scene, mechanisms, self.samples.joints())

    def modelled(self, q_rad: np.ndarray, by: Perturbation) -> np.ndarray:
        """(row, k)"""
        frames = perturbed_frames(self.predictor.arm, self.theta, q_rad, by)
        if self.rig.seat_m is not None:
            return self.predictor.tip_at(frames[:, -1])
        read = readings(self.predictor, frames[:, -1], self.samples, self.predictor.instruments)
        added = moved_columns(by)
        return np.stack([read[c] + added.get(c, 0.0) for c in read], axis=1)

    @property
    def theta(self) -> np.ndarray:
        return self.predictor.values_of(self.predictor.arm.parameters)

    def observed(self, read: Readings) -> np.ndarray:
        """(row, k) in the order of `modelled`."""
        found = {"dual-psd": read.spots_m, "position": read.position_m, "wire": read.length_m}
        values = found[self.predictor.instruments[0]]
        return values if values.ndim == 2 else values[:, None]

    def apart(self, found: FoundEffect) -> tuple[float, float]:
        """Rms of what mechanism and effect differ by, and of the effect."""
        by = Perturbation.none(len(self.samples), 6).plus(found.port, found.amount)
        simulated = self.simulated((mechanism_of(found),))
        if self.rig.seat_m is not None:  # the probe stays in its cone, and the encoders read something else
            seated = np.isfinite(self.rig.seat_m).all(axis=1)
            left = (self.modelled(simulated.reading_rad, by) - self.rig.seat_m)[seated]
            whole = (self.modelled(self.plain.reading_rad, by) - self.rig.seat_m)[seated]
            return rms(left), rms(whole)
        change = self.modelled(self.samples.joints(), by) - self.expected
        seen = np.isfinite(change).all(axis=1)
        return rms((self.observed(simulated) - self.observed(self.plain) - change)[seen]), rms(change[seen])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@cache
def bench(family: Family, *, in_turns: bool = False) -> Bench:
    return Bench(family, in_turns=in_turns)


def acts(term: Term, place: Bench) -> bool:
    """Whether it does anything in this session: an upright axis carries no weight."""
    basis = term.basis(place.drivers, np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner]))
    upright = term.depends_on == ("gravity_torque1",) and term.physics == "backlash"
    return bool(np.abs(basis).max() > 0.0) and not upright


def acting(place: Bench) -> tuple[Term, ...]:
    """Of the whole catalogue."""
    return tuple(term for term in terms_of(place.drivers) if acts(term, place))


def found_of(term: Term, place: Bench) -> FoundEffect:
    """With values of a machine: coefficients of either sign where it has several, springs that give way."""
    inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
    basis = term.basis(place.drivers, inner)
    coefficients = np.linspace(1.0, 0.4, basis.shape[2]) / np.maximum(np.abs(basis).max(axis=(0, 1)), 1e-12)
    size = np.abs(basis @ coefficients).max()
    return FoundEffect(term.physics, term, SIZE / size * coefficients, inner, place.session)


@cache
def one_of_each() -> dict[Family, list[Term]]:
    """Of every entry of the table, and of every port, one: the same entry at six joints is one law.

    And so it is in every family that has that port: they take turns.
    """
    kept: dict[tuple[object, ...], dict[Family, list[Term]]] = {}
    for family in FAMILIES:
        for term in acting(bench(family)):
            drivers = tuple(name.rstrip("0123456789") for name in term.depends_on)
            key = (term.physics, term.variant.rstrip("0123456789"), term.shape, term.port.where.strip("0123456789")[:4])
            kept.setdefault((*key, drivers if len(drivers) < 3 else ()), {}).setdefault(family, []).append(term)
    taken: dict[Family, list[Term]] = {family: [] for family in FAMILIES}
    for k, alike in enumerate(kept.values()):
        family = tuple(alike)[k % len(alike)]
        taken[family].append(alike[family][k % len(alike[family])])
    return taken


@pytest.mark.parametrize("family", FAMILIES)
def test_model_and_simulation_read_the_same_without_physics(family: Family) -> None:
    place = bench(family)
    if place.rig.seat_m is not None:
        seated = np.isfinite(place.rig.seat_m).all(axis=1)
        tips = place.modelled(place.plain.reading_rad, Perturbation.none(len(place.samples), 6))
        assert np.abs(tips - place.rig.seat_m)[seated].max() < 1e-10
        return
    seen = np.isfinite(place.expected).all(axis=1)
    assert seen.all()
    assert np.abs(place.observed(place.plain) - place.expected)[seen].max() < 1e-10


@pytest.mark.parametrize("family", FAMILIES)
def test_every_effect_is_what_its_mechanism_does(family: Family) -> None:
    place = bench(family)
    wrong = []
    assert one_of_each()[family]
    for term in one_of_each()[family]:
        found = found_of(term, place)
        off, whole = place.apart(found)
        if off > counterpart_of(found).within * whole + 1e-11:
            wrong.append(f"{term.key}: {off:.2e} of {whole:.2e}")
    assert not wrong, "\n".join(wrong)


def test_a_six_d_target_and_a_camera_are_where_the_model_has_them() -> None:
    place = bench("tracker")
    about = {
        **place.predictor.about,
        "tool": (*place.predictor.about["tool"][:3], 0.1, -0.2, 0.3),
        "camera": (1.0, 2.0, 0.5, 0.1, 0.2, 0.3),
        "marker": (0.01, 0.02, 0.03, 0.3, 0.1, -0.2),
    }
    moved = {"tool.roll": 1e-3, "camera.x": 1e-3, "camera.yaw": 2e-3, "marker.y": 1e-3, "marker.pitch": -2e-3}
    predictor = replace(place.predictor, about=about, values={**place.predictor.values, **moved})
    read = replayed(rigged(predictor, place.samples), place.scene, (), place.samples.joints())
    wanted = readings(predictor, predictor.flange(place.samples.joints()), place.samples, ["full-pose", "camera-pose"])
    for names, values in ((POSITION, read.position_m), (PLACE, read.camera_m)):
        np.testing.assert_allclose(values, np.stack([wanted[c] for c in names], axis=1), rtol=0.0, atol=1e-10)
    for names, values in ((ORIENTATION, read.turn_rad), (TURN, read.camera_rad)):
        assert values is not None
        turned = Rotation.from_rotvec(values).inv() * Rotation.from_rotvec(np.stack([wanted[c] for c in names], axis=1))
        assert turned.magnitude().max() < 1e-9


def test_all_stations_of_a_table_move_as_one_body_where_the_arm_goes_to_and_fro_between_them() -> None:
    place = bench("dual-psd", in_turns=True)
    term = next(term for term in acting(place) if term.physics == "fixture-moved" and term.variant == ONE_BODY)
    off, whole = place.apart(found_of(term, place))
    assert off < 0.02 * whole


def test_every_entry_of_the_table_is_met_by_the_catalogue() -> None:
    benches = (*map(bench, FAMILIES), bench("dual-psd", in_turns=True))
    met = {id(counterpart_of(found_of(term, place))) for place in benches for term in acting(place)}
    never = [f"{form.physics}: {form.name}" for form, counterpart in TABLE.items() if id(counterpart) not in met]
    assert never == []


def test_two_encoders_see_the_drive_from_where_they_sit() -> None:
    """In the difference of both encoders, what the effect adds there; at the flange, what it adds to the chain."""
    place = bench("tracker")
    rows, joints = len(place.samples), (1, 2, 3, 4, 5, 6)
    readout = Readout(kind_of(ENCODER_DIFFERENCE), np.zeros((rows, 6)), np.ones(rows, dtype=bool), joints=joints)
    drivers = replace(place.drivers, readouts={**place.drivers.readouts, ENCODER_DIFFERENCE: readout})
    session = FoundIn.of(place.predictor, drivers)
    sites = [t for t in terms_of(drivers) if t.port.where == "joint2.angle" and (not t.open or t.shape is Shape.SMOOTH)]
    for term in sites:
        found = replace(found_of(term, place), session=session)
        by = Perturbation.none(rows, 6).plus(term.port, found.amount)
        read = place.simulated((mechanism_of(found),))
        within = counterpart_of(found).within
        wanted = by.between_rad + by.readings.get(ENCODER_DIFFERENCE, 0.0)
        assert rms(read.between_rad - wanted) <= within * rms(wanted) + 1e-9, term.key
        change = place.modelled(place.samples.joints(), by) - place.expected
        apart = place.observed(read) - place.observed(place.plain) - change
        assert rms(apart) <= within * rms(change) + 1e-9, term.key
    assert {FoundEffect(term.physics, term, np.zeros(0), np.zeros(0), session).place for term in sites} == {"", *PLACES}


@pytest.mark.endure  # daily: one of each, above
@pytest.mark.parametrize("family", FAMILIES)
def test_every_effect_is_what_its_mechanism_does_at_every_place(family: Family) -> None:
    place = bench(family)
    for term in acting(place):
        found = found_of(term, place)
        off, whole = place.apart(found)
        assert off <= counterpart_of(found).within * whole + 1e-11, term.key
