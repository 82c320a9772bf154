"""A concealed session over the emulated wires tells what the fast path says of the same poses, within its noise."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.prove.concealing import conceal_on_wires
from simulators.conceal.observe import observe
from simulators.conceal.wanted import Wanted


@pytest.mark.endure  # most of a minute; `make prove` holds sessions on wires, too
@pytest.mark.timeout(600)
def test_a_session_on_the_wires_is_that_of_the_fast_path_within_noise(tmp_path: Path) -> None:
    wanted = Wanted("dual-psd", seed=31, defects=("soft-joint",), enr=5.0, samples=16, places=1)
    case = conceal_on_wires(wanted, tmp_path / "recording.mcap")
    recording = read(tmp_path / "recording.mcap")
    assert recording.complete
    assert len(recording.samples) == len(case.values_m) >= 12
    off_m = case.values_m - case.exact.values_m
    rms_m = float(np.sqrt(np.mean(off_m**2)))
    assert rms_m < 2.0 * case.sigma_m  # gears that seat anew, 200 readings averaged
    stiff = observe(case.drawn.true, case.table.scene, (), case.posture_rad)
    assert np.sqrt(np.mean((case.values_m - stiff.values_m) ** 2)) > 5.0 * rms_m  # so what is hidden was at work
    assert recording.rig.emulation is None  # and the recording says nothing of it
    assert not recording.notes
    assert "soft-joint" not in recording.rig_text
