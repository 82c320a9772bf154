"""`predict` with every instrument: a row for a row, observed columns' own names, empty where nothing can be said."""

import csv
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from calibeam.cli import run
from calibrate.model.model_file import ModelFile, RigIdentity, write_model

RIG = """schema = 1
name = "two-joints"
[arm]
model = "{model}"
{joints}
[tool]
point_m = [0.1, 0.0, 0.0]
laser_origin_m = [0.0, 0.0, 0.0]
laser_direction = [1.0, 0.0, 0.0]
[fixture]
half_size_m = 0.01
psd2_in_psd1 = {{ origin_m = [0.0, 0.045886, 0.065532], rotation_rad = [1.9198621771937625, 0.0, 0.0] }}
[[placement]]
id = 1
psd1_in_base = {{ origin_m = [0.9, 0.0, 0.3], rotation_rad = [0.0, -1.5707963267948966, 0.0] }}
[device]
origin_m = [2.0, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]
[[bar]]
id = 4
length_m = 0.4
"""
LIMITS = "lower_rad = -3.2\nupper_rad = 3.2\n"
DH = "[[arm.joint]]\na_m = {a}\nalpha_rad = 0.0\nd_m = {d}\n" + LIMITS
POE = "[[arm.joint]]\norigin_m = [{x}, 0.0, {z}]\nrotation_rad = [0.0, 0.0, 0.0]\n" + LIMITS
# A flat arm of two links of 0.3 and 0.2 m, 0.3 m above the base, in all three ways of writing it.
ARMS = {
    "dh": DH.format(a=0.3, d=0.3) + DH.format(a=0.2, d=0.0),
    "mdh": DH.format(a=0.0, d=0.3) + DH.format(a=0.3, d=0.0) + "[arm.flange]\norigin_m = [0.2, 0.0, 0.0]\n",
    "local-poe": POE.format(x=0.0, z=0.3) + POE.format(x=0.3, z=0.0) + "[arm.flange]\norigin_m = [0.2, 0.0, 0.0]\n",
}
Q = ((0.0, 0.0), (0.5, 0.0), (0.5, -0.5))
TIPS = np.array([[0.3 * np.cos(a) + 0.3 * np.cos(a + b), 0.3 * np.sin(a) + 0.3 * np.sin(a + b), 0.3] for a, b in Q])
SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
XYZ = ("x_m", "y_m", "z_m")
TIP = ("tip_x_m", "tip_y_m", "tip_z_m")


@pytest.fixture(params=list(ARMS))
def model(request, tmp_path):
    text = RIG.format(model=request.param, joints=ARMS[request.param])
    path = tmp_path / "model.json"
    write_model(path, model_file(RigIdentity("two-joints", "0" * 64, text), request.param))
    return path


def model_file(rig, arm_model):
    return ModelFile(
        schema=1,
        kind="calibeam-model",
        software="calibeam",
        rig=rig,
        arm_model=arm_model,
        status="CONVERGED",
        says="",
        poses=3,
        rank=0,
        free=0,
        condition=1.0,
        singular_values=(),
        unseen=(),
        parameters=(),
        chain={},
        covariance=None,
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=0.0,
        rms_distance_before_m=0.0,
        rms_coordinate_after_m=0.0,
        rms_distance_after_m=0.0,
        instruments=("position",),
    )


def predicted(model, columns, suffix=".csv"):
    """Columns of the written file, a list of cells each."""
    samples, out = model.with_name("samples" + suffix), model.with_name("predicted.csv")
    rows = [(i, *q, *cells) for i, (q, cells) in enumerate(zip(Q, zip(*columns.values(), strict=True), strict=True))]
    if suffix == ".csv":
        with samples.open("w", newline="") as file:
            csv.writer(file).writerows([("t_s", "q1_rad", "q2_rad", *columns), *rows])
    assert run(["predict", str(model), str(samples), "--out", str(out)]) == 0
    with out.open() as file:
        header, *cells = csv.reader(file)
    return dict(zip(header, zip(*cells, strict=True), strict=True))


def test_positions_and_residuals_where_there_is_an_observation(model):
    x = [repr(float(TIPS[0, 0] - 2.0)), "", repr(float(TIPS[2, 0] - 2.001))]
    out = predicted(model, {"x_m": x, "y_m": ["0.0", "", "0.0"], "z_m": ["0.3", "", "0.3"]})
    assert list(out) == ["t_s", *XYZ, *(f"s_{c}" for c in XYZ), *(f"r_{c}" for c in XYZ), "outside"]
    assert out["t_s"] == ("0.0", "1.0", "2.0")
    np.testing.assert_allclose([float(v) for v in out["x_m"]], TIPS[:, 0] - 2.0, atol=1e-12)
    assert out["r_x_m"][1] == out["r_y_m"][1] == ""
    assert float(out["r_x_m"][2]) == pytest.approx(1e-3, abs=1e-12)


def test_a_wire_has_one_column(model):
    out = predicted(model, {"wire_m": ["1.0", "", "1.0"]})
    assert list(out) == ["t_s", "wire_m", "s_wire_m", "r_wire_m", "outside"]
    np.testing.assert_allclose([float(v) for v in out["wire_m"]], np.linalg.norm(TIPS - [2, 0, 0], axis=1), atol=1e-12)


def test_cones_and_bars_get_the_tip_in_the_base_and_no_residual(model):
    out = predicted(model, {"seat": ["1", "", ""], "bar": ["", "4", ""], "bar_end": ["", "a", ""]})
    assert list(out) == ["t_s", *TIP, *(f"s_{c}" for c in TIP), "outside"]
    np.testing.assert_allclose([[float(out[c][i]) for c in TIP] for i in (0, 1)], TIPS[:2], atol=1e-12)
    assert [out[c][2] for c in TIP] == ["", "", ""]


def test_spots_stand_where_the_fixture_is_named(model):
    """The beam of the stretched arm runs along x through the origin of PSD 1."""
    named = {"placement": ["1", "", "1"], "first_psd": ["1", "", "1"]}
    out = predicted(model, named | {c: ["0.001", "", ""] for c in SPOTS})
    assert list(out) == ["t_s", *SPOTS, *(f"s_{c}" for c in SPOTS), *(f"r_{c}" for c in SPOTS), "outside"]
    assert [float(out[c][0]) for c in SPOTS[:2]] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert [float(out[f"r_{c}"][0]) for c in SPOTS[:2]] == pytest.approx([-1e-3, -1e-3], abs=1e-12)
    assert {out[c][1] for c in out if c != "t_s"} == {""}
    assert out["psd1_x_m"][2] != ""
    assert out["r_psd1_x_m"][2] == ""


def test_several_instruments_at_once_and_samples_without_any(model):
    both = predicted(
        model, {"x_m": ["0.0", "", ""], "y_m": ["0.0", "", ""], "z_m": ["0.0", "", ""], "seat": ["", "2", ""]}
    )
    assert list(both) == ["t_s", *XYZ, *TIP, *(f"s_{c}" for c in (*XYZ, *TIP)), *(f"r_{c}" for c in XYZ), "outside"]
    assert list(predicted(model, {"note": ["1", "2", "3"]})) == ["t_s", *XYZ, *(f"s_{c}" for c in XYZ), "outside"]


def test_a_parquet_table_is_read_as_well(model):
    columns = {"t_s": [0, 1, 2], "q1_rad": [q[0] for q in Q], "q2_rad": [q[1] for q in Q], "wire_m": [1.0, None, 1.0]}
    parquet = model.parent / "samples.parquet"
    pyarrow.parquet.write_table(pyarrow.table(columns), parquet)
    from_csv = predicted(model, {"wire_m": ["1.0", "", "1.0"]})
    assert predicted(model, {"wire_m": ["1.0", "", "1.0"]}, ".parquet") == from_csv


def test_a_recording_is_predicted_like_its_table(tmp_path, capsys):
    folder = Path(__file__).parents[1] / "golden" / "data" / "formats" / "tracker"
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 0
    for name, samples in (("folder", folder), ("table", folder / "samples.csv")):
        assert run(["predict", str(tmp_path / "model.json"), str(samples), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "folder").read_bytes() == (tmp_path / "table").read_bytes()
    other = Path(__file__).parents[1] / "golden" / "data" / "demo.mcap"
    assert run(["predict", str(tmp_path / "model.json"), str(other), "--out", str(tmp_path / "x")]) == 1
    assert "samples of 6 joints, but the model's arm has 3" in " ".join(capsys.readouterr().err.split())
