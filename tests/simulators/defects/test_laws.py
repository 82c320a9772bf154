"""Laws that every mechanism keeps, over the whole tuple and every instrument that it names."""

from functools import cache

import numpy as np
import pytest

from simulators.conceal.case import Case, conceal
from simulators.conceal.observe import observe
from simulators.conceal.wanted import INSTRUMENT, Wanted
from simulators.defects.defect import Defect, size_of, with_size
from simulators.defects.mechanisms import MECHANISMS, RAISED

PORTS = {
    *(f"joint{i}.angle" for i in range(1, 7)),
    *(f"link{i}.{what}" for i in ("*", *range(1, 7)) for what in ("length", "tilt")),
    *("base.pose", "tool.point", "laser.direction", "fixture.pose", "psd1.reading", "psd2.reading"),
    *("device.reading", "device.pose", "seat.position", "time"),
    *("fixture*.pose", "seat*.position"),
}
PHYSICS = {
    "encoder-eccentricity",
    "encoder-harmonic",
    "gear-transmission-error",
    "gear-ratio-error",
    "joint-coupling",
    "joint-compliance",
    "payload-compliance",
    "backlash",
    "encoder-slip",
    "axis-wobble",
    "link-thermal-growth",
    "base-compliance",
    "base-moved",
    "latency",
    "reading-lag",
    "tool-sag",
    "link-bending",
    "psd-nonlinearity",
    "psd-gain",
    "psd-ambient-light",
    "psd-cover-glass",
    "laser-warm-up",
    "laser-thermal-drift",
    "fixture-moved",
    "device-scale",
    "device-drift",
    "device-periodic",
    "seat-moved",
    "tool-moved",
    "laser-moved",
    "psd-local-defect",
    "load-hysteresis",
    "load-centre",
    "not-settled",
    "unknown",
}
FAMILY = {instrument: family for family, instrument in INSTRUMENT.items()}
ALL = (*MECHANISMS, *RAISED)
OF_EACH = [kind.INSTRUMENTS[k % len(kind.INSTRUMENTS)] for k, kind in enumerate(ALL)]
EVERYWHERE = [  # daily: every mechanism at one instrument, which takes turns with the others; each session is a search
    pytest.param(kind, instrument, marks=[] if instrument == one else pytest.mark.endure)
    for kind, one in zip(ALL, OF_EACH, strict=True)
    for instrument in kind.INSTRUMENTS
]


def name(value: object) -> str:
    return getattr(value, "KIND", str(value))


@cache
def session(kind: type[Defect], instrument: str) -> Case:
    family = FAMILY[instrument]
    places = 4 if family == "cones" else 2
    return conceal(Wanted(family, seed=4, defects=(kind.KIND,), samples=45, places=places))


def seen(case: Case, defects: list[Defect]) -> np.ndarray:
    wire = case.wanted.family == "wire"
    found = observe(case.drawn.true, case.table.scene, defects, case.posture_rad, wire=wire)
    return np.concatenate((found.reading_rad, found.values_m), axis=1)


@pytest.mark.parametrize(("kind", "instrument"), EVERYWHERE, ids=name)
def test_zero_size_changes_nothing_and_its_own_size_does(kind: type[Defect], instrument: str) -> None:
    case = session(kind, instrument)
    defect = case.hidden[0].defect
    assert isinstance(defect, kind)
    perfect = seen(case, [])
    assert size_of(defect) != 0.0
    np.testing.assert_allclose(seen(case, [with_size(defect, 0.0)]), perfect, rtol=0.0, atol=1e-11)
    assert np.abs(seen(case, [defect]) - perfect).max() > 1e-7


@pytest.mark.parametrize(("kind", "instrument"), EVERYWHERE, ids=name)
def test_twice_the_size_is_nearly_twice_the_effect(kind: type[Defect], instrument: str) -> None:
    """So that a size can be found for a wanted effect over noise; the play of a long slack is the extreme."""
    case = session(kind, instrument)
    defect = case.hidden[0].defect
    perfect = seen(case, [])
    once = np.linalg.norm(seen(case, [defect]) - perfect)
    twice = np.linalg.norm(seen(case, [with_size(defect, 2.0 * size_of(defect))]) - perfect)
    assert twice / once == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(("kind", "instrument"), EVERYWHERE, ids=name)
def test_it_names_its_place_in_the_words_of_the_interchange_format(kind: type[Defect], instrument: str) -> None:
    defect = session(kind, instrument).hidden[0].defect
    assert defect.port in PORTS
    assert kind.PHYSICS in PHYSICS
    assert (kind.PHYSICS == "unknown") == kind.KIND.startswith("outside-")
    assert bool(defect.figures) == (kind.PHYSICS != "unknown")


def test_every_instrument_has_its_turn() -> None:
    assert set(OF_EACH) == set(FAMILY)


def test_names_are_unique() -> None:
    kinds = [kind.KIND for kind in ALL]
    assert len(set(kinds)) == len(kinds)
    assert len({kind.PHYSICS for kind in MECHANISMS} - {"unknown"}) >= 22
    assert sum(kind.PHYSICS == "unknown" for kind in MECHANISMS) >= 6
