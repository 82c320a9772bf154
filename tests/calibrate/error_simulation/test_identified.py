"""The arm of a model file is the arm that predictions are made with."""

import numpy as np
import pytest

from acquisition.recording.rig import load_rig, rig_sha256, rig_text
from calibrate.error_simulation.machine import identified_machine, machine_of
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.model.model_file import RigIdentity
from calibrate.model.predict import Predictor
from tests.calibrate.conftest import spot_samples
from tests.calibrate.error_simulation.conftest import RIGS

RIG = RIGS / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def result(sessions):
    rig, session = load_rig(RIG), sessions(41, n=60, repeats=6)
    return identify(rig, spot_samples(session), rng=np.random.default_rng(0), held_out_share=0.0)


def test_an_identified_arm_puts_its_probe_where_it_is_predicted(result):
    rig, text = load_rig(RIG), rig_text(RIG)
    model = record_of(result, RigIdentity(rig.name, rig_sha256(text), text), "dh")
    machine, _ = identified_machine(model)
    q = machine.drawn_poses(20, np.random.default_rng(1))
    np.testing.assert_allclose(machine.tip_m(q), Predictor.of(model).tip_m(q), atol=1e-14)
    assert np.abs(machine.tip_m(q) - machine_of(rig).tip_m(q)).max() > 1e-3  # zeros of some degrees


def test_a_model_without_its_rig_is_refused(result):
    with pytest.raises(DataError, match="identify again"):
        identified_machine(record_of(result, RigIdentity("ur5e-dual-psd", "0" * 64), "dh"))
