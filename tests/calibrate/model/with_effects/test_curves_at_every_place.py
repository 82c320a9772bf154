"""An unknown cause acts in a prediction where the fit had it: two places of the chain may share a name.

A tilt of link 1 in front of joint 1 and one behind it are both `link1.tilt`; a model once put the second at the first,
and predicted a real arm 11 mm off.
"""

import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.linalg import block_diag

from acquisition.recording import read
from calibrate.apply.predicting import predict_with_physics
from calibrate.diagnose.gross_errors import Cleared
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.port_process import places_of
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.errors import DataError
from calibrate.model.effects.curve import curve
from calibrate.model.effects.ports import Place
from calibrate.model.effects.term import Accepted
from calibrate.model.sensors.catalogue import BY_NAME
from calibrate.model.with_effects.chain import Evaluations
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

WAVES, PLAIN = 3, 1e-6  # m or rad, within the noise, and far above rounding


@pytest.fixture(scope="module", params=("tracker",))
def geometry(request):
    with tempfile.TemporaryDirectory() as folder:
        write_case(conceal(Wanted(request.param, 5, samples=40)), Path(folder))
        recording = read(Path(folder) / "recording")
    return recording, fit_geometry(session_of(recording.rig, recording.samples))


def with_one(fit, port, component):
    """The fit with a curve over q2 put in, nothing refitted."""
    term = curve(port, component, ("q2",), WAVES)
    one = Accepted(term, np.array([PLAIN, -0.5 * PLAIN, 0.25 * PLAIN]), np.zeros(0))
    sizes = (np.full(WAVES, PLAIN),)
    chain = fit.session.chain((one,), fit.drivers)
    problem = replace(fit.problem, chain=chain, sizes=sizes, known=Evaluations())
    wider = block_diag(fit.covariance, np.zeros((WAVES, WAVES)))
    return replace(fit, problem=problem, values=np.concatenate([fit.geometry, one.coefficients]), covariance=wider)


def asked_of(fit):
    """Every port that shares its name with another, and one of each other kind of place; a component of each."""
    ports = dict(places_of(Bench(fit)))
    names = Counter(port.where for port in ports)
    first = {port.place: port for port in reversed(ports)}
    asked = [port for port in ports if names[port.where] > 1 or port in first.values()]
    assert max(names.values()) > 1
    assert any(port.place is Place.SURROUNDINGS for port in asked)
    return [(port, ports[port]) for port in asked]


@pytest.mark.parametrize(  # daily for all links: the first and the last
    "spared", [("link2", "link3", "link4"), pytest.param((), marks=pytest.mark.endure)], ids=["some", "all"]
)
def test_a_model_predicts_a_curve_at_the_very_place_where_it_was_found(geometry, spared):
    recording, fit = geometry
    samples = recording.samples
    cleared = Cleared(samples, np.arange(len(samples)), ())
    (measured,) = fit.session.measured
    for port, component in asked_of(fit):
        if port.where.startswith(spared):
            continue
        curved = with_one(fit, port, component)
        (expected,) = curved.around.expected
        model = structs.replace(model_of_fit(curved, fit, cleared, recording, "one curve"), covariance=None)
        found = predict_with_physics(model, samples, same_session=True).columns
        predicted = np.stack([found[name] for name in BY_NAME[measured.name].reads], axis=1)
        assert np.ptp(expected - fit.around.expected[0]) > 1e-8  # m: it is felt
        assert np.allclose(predicted, expected, rtol=0.0, atol=1e-12), port


def test_a_file_without_the_place_is_refused_where_two_places_share_the_name(geometry):
    recording, fit = geometry
    samples = recording.samples
    names = Counter(port.where for port, _ in asked_of(fit))
    port, component = next((p, c) for p, c in asked_of(fit) if names[p.where] > 1)
    model = model_of_fit(
        with_one(fit, port, component), fit, Cleared(samples, np.arange(len(samples)), ()), recording, ""
    )
    old = structs.replace(model, effects=(structs.replace(model.effects[0], place="", frame=None),))
    with pytest.raises(DataError, match=f"at {port.where}: several places have this name; diagnose"):
        predict_with_physics(old, samples, same_session=True)
