"""`calibeam rig`: a rig file that the other commands take, and every refusal before a file is written."""

import csv
from importlib.machinery import ModuleSpec

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibeam.commands.rig import shipped_rigs
from calibrate.model.arms.rig_arm import RigArm

URDF = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>
<child link="b"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint></robot>"""


def test_the_list_has_every_shipped_rig_with_what_it_is(capsys):
    assert run(["rig", "list"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in shipped_rigs())
    assert "FANUC LR Mate 200iD" in out


def test_a_shipped_rig_is_copied_to_the_letter_and_never_over_a_file(tmp_path, capsys):
    out = tmp_path / "new" / "rig.toml"
    assert run(["rig", "new", "--from", "ur20", "--out", str(out)]) == 0
    assert out.read_bytes() == shipped_rigs()["ur20"].read_bytes()
    assert "6 joints, dh, 6 with a mass" in capsys.readouterr().out
    assert run(["rig", "new", "--from", "ur30", "--out", str(out)]) == 1
    assert "is not written over" in capsys.readouterr().err
    assert load_rig(out).name == "ur20"


def test_a_rig_from_a_urdf_and_from_a_table(tmp_path, capsys):
    (tmp_path / "r.urdf").write_text(URDF)
    (tmp_path / "t.csv").write_text("standard,a_mm,alpha_deg,d_mm,theta_deg\n1,100,90,0,0\n")
    for option, file, out in (("--from-urdf", "r.urdf", "u.toml"), ("--from-dh", "t.csv", "d.toml")):
        assert run(["rig", "new", option, str(tmp_path / file), "--out", str(tmp_path / out)]) == 0
        assert load_rig(tmp_path / out).n_joints == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "give one of"),
        (["--from", "ur5e", "--from-urdf", "a.urdf"], "give one of"),
        (["--from", "nothing"], "no shipped rig nothing"),
        (["--from-urdf", "missing.urdf"], "cannot read the URDF file"),
        (["--from-mjcf", "missing.xml"], "no such file"),
        (["--from-dh", "missing.csv"], "cannot read the D-H table"),
    ],
)
def test_a_refusal_writes_nothing(tmp_path, monkeypatch, capsys, words, says):
    monkeypatch.chdir(tmp_path)
    assert run(["rig", "new", *words]) == 1
    assert says in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_name_of_robot_descriptions_is_taken_where_that_is_installed(tmp_path, monkeypatch):
    package = tmp_path / "robot_descriptions"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "one_arm.py").write_text(f"URDF_PATH = {str(tmp_path / 'r.urdf')!r}\n")
    (tmp_path / "r.urdf").write_text(URDF)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert isinstance(__import__("importlib.util").util.find_spec("robot_descriptions"), ModuleSpec)
    assert run(["rig", "new", "--from-urdf", "one_arm"]) == 0
    assert load_rig(tmp_path / "rig.toml").n_joints == 1
    assert run(["rig", "new", "--from-urdf", "no_arm", "--out", "other.toml"]) == 1


@pytest.fixture
def fanuc(tmp_path):
    """A session folder of a FANUC and a tracker: readings as its controller reports them."""
    name = "fanuc-lrmate-200id"
    text = shipped_rigs()[name].read_text()
    (tmp_path / "rig.toml").write_text(text + "\n[tolerance]\nlength_m = 1e-6\nangle_rad = 1e-6\n")
    arm, rng = RigArm.of_rig(load_rig(tmp_path / "rig.toml")), np.random.default_rng(3)
    q_rad = rng.uniform([-1.5, -1.0, -0.8, -1.5, -1.5, -2.0], [1.5, 0.6, 1.0, 1.5, 1.5, 2.0], (60, 6))
    x_m = arm.tip_m(q_rad + np.array([0, 1e-3, -2e-3, 0, 0, 0])) + rng.normal(0.0, 2e-5, (60, 3))
    with (tmp_path / "samples.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", *(f"q{i}_rad" for i in range(1, 7)), "x_m", "y_m", "z_m"])
        writer.writerows([i, *q, *x] for i, (q, x) in enumerate(zip(q_rad.tolist(), x_m.tolist(), strict=True)))
    return tmp_path


def test_a_coupled_robot_is_identified_predicted_and_exported_where_a_form_allows(fanuc, monkeypatch, capsys):
    monkeypatch.chdir(fanuc)
    assert run(["identify", ".", "--out", "model.json"]) == 0
    assert run(["predict", "model.json", "samples.csv", "--out", "predicted.csv"]) == 0
    with (fanuc / "predicted.csv").open() as file:
        rows = list(csv.DictReader(file))
    residuals = np.array([[float(row[f"r_{axis}_m"]) for axis in "xyz"] for row in rows])
    assert np.sqrt(np.mean(residuals**2)) < 4e-5
    capsys.readouterr()
    assert run(["identify", ".", "--out", "model2.json", "--export", "urdf"]) == 0
    assert (fanuc / "model2.urdf").is_file()
    assert run(["tool-axes", "."]) == 1
    assert "turns two axes at once" in capsys.readouterr().err


def test_an_emulated_robot_counts_as_drawn(tmp_path, request, capsys):
    text = (request.config.rootpath / "rigs" / "ur5e-dual-psd.toml").read_text()
    rig = tmp_path / "rig.toml"
    rig.write_text(text.replace("d_m = 0.1625", "d_m = 0.1625\nsign = -1", 1))
    assert run(["demo", "--rig", str(rig), "--out", str(tmp_path / "out")]) == 1
    assert "without sign" in capsys.readouterr().err
