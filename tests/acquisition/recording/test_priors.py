"""Optional sizes of belief in [tolerance], and full poses among the samples: accepted whole, refused by halves."""

from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError, SamplesError
from acquisition.recording.rig import parse_rig, rig_text
from acquisition.recording.session_folder.tables import parse_csv


@pytest.fixture
def source(root: Path) -> str:
    return rig_text(root / "rigs" / "ur5e-dual-psd.toml")


def with_priors(source: str, lines: str) -> str:
    return source.replace("[tolerance]\n", f"[tolerance]\n{lines}\n", 1)


def test_gain_and_second_face_may_be_assumed_to_a_sigma(source: str) -> None:
    rig = parse_rig(with_priors(source, 'gain = 2e-3\npsd2_m = "50 um"\npsd2_rad = "1 mrad"'), "x.toml")
    assert rig.tolerance is not None
    assert (rig.tolerance.gain, rig.tolerance.psd2_m, rig.tolerance.psd2_rad) == (2e-3, 5e-5, 1e-3)
    assert rig.tolerance.device_m is None


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("psd2_m = 1e-4", "add 'psd2_rad'"),
        ("device_rad = 1e-3", "add 'device_m'"),
        ("device_m = 1e-3\ndevice_rad = 1e-3", r"there is no \[device\]"),
        ("gain = -1.0", "gain"),
    ],
)
def test_half_a_prior_and_one_about_nothing_are_refused(source: str, lines: str, says: str) -> None:
    with pytest.raises(RigFileError, match=says):
        parse_rig(with_priors(source, lines), "x.toml")


READINGS = ",".join(f"q{i}_rad" for i in range(1, 7))


@pytest.mark.parametrize(
    ("columns", "cells", "says"),
    [
        ("rx_rad,ry_rad,rz_rad", "0,0,0", "column 'x_m'"),
        ("x_m,y_m,z_m,rx_rad,ry_rad", "1,1,1,0,0", "column 'rz_rad'"),
        ("x_m,y_m,z_m,rx_rad,ry_rad,rz_rad", "1,1,1,0,,0", "column 'ry_rad'.* give all or none"),
    ],
)
def test_an_orientation_is_whole_and_next_to_a_position(source: str, columns: str, cells: str, says: str) -> None:
    rig = parse_rig(source, "x.toml")
    with pytest.raises(SamplesError, match=says):
        parse_csv(f"t_s,{READINGS},{columns}\n0,0,0,0,0,0,0,{cells}\n", "samples.csv", rig)
