"""`compare`: a simulation that lacks geometry, stands elsewhere, is of another rig, or is a program of one's own."""

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import read
from calibeam.cli import run
from calibeam.results.simulator import Simulator

CLIENTS = Path(__file__).parents[2] / ".venv-clients" / "bin"
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples" / "simulators"
NOISE_M = 20e-6
SAMPLES = 60
TRACKER = Rotation.from_rotvec([0.1, -0.2, 1.3]), np.array([2.0, 0.5, 0.3])  # in the base


def arm(**changed):
    """The example's arm, written apart from the program, with other constants."""
    spec = importlib.util.spec_from_file_location("numpy_arm", EXAMPLES / "numpy_arm.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, by in changed.items():
        setattr(module, name, [a + b for a, b in zip(getattr(module, name), by, strict=True)])
    return module


def poses(seed=5):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (SAMPLES, 6)) + np.array([0.0, -1.0, 0.5, 0.0, 0.8, 0.0])


def session(folder, q_rad, true_q_rad, world, *, seed=0, tracker=TRACKER, rig=None, noise_m=NOISE_M, **columns):
    """A session folder as a simulator of somebody's own would write it."""
    rotation, origin_m = tracker
    tips = np.array([world.reflector_m(q) for q in true_q_rad])
    seen = rotation.inv().apply(tips - origin_m) + np.random.default_rng(seed).normal(0.0, noise_m, tips.shape)
    folder.mkdir()
    (folder / "rig.toml").write_text(rig or (EXAMPLES / "rig.toml").read_text(encoding="utf-8"), encoding="utf-8")
    table = {"t_s": np.arange(len(q_rad), dtype=float)} | {f"q{j + 1}_rad": q_rad[:, j] for j in range(6)} | columns
    table |= dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))
    rows = zip(*(np.asarray(v).tolist() for v in table.values()), strict=True)
    text = "\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)])
    (folder / "samples.csv").write_text(text + "\n", encoding="utf-8")
    return folder


def compared(tmp_path, *arguments):
    out = tmp_path / "compare.json"
    assert run(["compare", *map(str, arguments), "--out", str(out)]) == 0
    return json.loads(out.read_bytes())


def deciding(said):
    return {one["where"]: one for one in said["differences"] if one["decides"]}


def near(size, value, sigmas=4.0):
    return abs(size["value"] - value) < sigmas * size["sigma"]


@pytest.fixture(scope="module")
def off(tmp_path_factory):
    """Measured with joint 3 off by 2 mrad and link 2 longer by 0.4 mm."""
    q_rad = poses()
    return session(
        tmp_path_factory.mktemp("off") / "measured",
        q_rad,
        q_rad + np.array([0.0, 0.0, 2e-3, 0.0, 0.0, 0.0]),
        arm(A_M=[0.0, 4e-4, 0.0, 0.0, 0.0, 0.0]),
    )


def names_both(said):
    found = deciding(said)
    assert said["verdict"] == "mismatch"
    assert set(found) == {"joint3.angle", "link2.length"}
    zero, link = found["joint3.angle"]["sizes"]["zero_rad"], found["link2.length"]["sizes"]["length_m"]
    assert near(zero, 2e-3)
    assert near(link, 4e-4)
    assert 1.2e-5 < zero["sigma"] < 2.5e-5  # 1.0e-5 where the constants that were dropped count as exact
    assert link["sigma"] < 2e-5
    (position,) = said["readings"]
    assert position["rms_coordinate_before"] > 10.0 * NOISE_M
    assert position["rms_coordinate_after"] < 1.15 * NOISE_M


def test_nominal_geometry_against_an_arm_that_is_off_names_both_constants(off, tmp_path, capsys):
    simulated = session(tmp_path / "simulated", poses(), poses(), arm(), noise_m=0.0)
    said = compared(tmp_path, off, simulated)
    names_both(said)
    printed = capsys.readouterr().out
    assert printed.index("mismatch") < printed.index("joint3 ") < printed.index("link2.length")
    assert {one["where"] for one in said["dropped"]}.isdisjoint(deciding(said))
    assert all(size["sigma"] > 0.0 for one in said["dropped"] for size in one["sizes"].values())


def test_a_program_of_thirty_lines_is_a_simulation(off, tmp_path):
    command = f"{sys.executable} {EXAMPLES / 'numpy_arm.py'}"
    answer = Simulator(command).readings(read(off).samples)
    expected = np.array([arm().reflector_m(q) for q in poses()])
    assert np.array_equal(np.stack([answer[name] for name in ("x_m", "y_m", "z_m")], axis=1), expected)
    said = compared(tmp_path, off, "--simulator", command, "--no-diagnose")
    assert said["matched"] == SAMPLES
    assert said["first_link"] == "position"
    assert said["verdict"] == "mismatch"


def test_a_mjcf_is_a_simulation_and_is_asked_by_file(off):
    command = f"{sys.executable} {EXAMPLES / 'mujoco_arm.py'} {EXAMPLES / 'arm.xml'} {{samples}}"
    answer = Simulator(command).readings(read(off).samples)
    expected = np.array([arm().reflector_m(q) for q in poses()])
    assert np.stack([answer[name] for name in ("x_m", "y_m", "z_m")], axis=1) == pytest.approx(expected, abs=1e-12)


def test_an_fmu_is_a_simulation_through_fmpy(off, tmp_path):
    if not CLIENTS.is_dir():
        pytest.skip("no environment for third-party clients: make clients")
    for name in ("arm_as_fmu.py", "numpy_arm.py"):
        shutil.copy(EXAMPLES / name, tmp_path)
    build = [CLIENTS / "pythonfmu", "build", "-f", "arm_as_fmu.py", "numpy_arm.py", "--no-external-tool"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    command = f"{CLIENTS / 'python'} {EXAMPLES / 'fmu_arm.py'} {tmp_path / 'Arm.fmu'} {{samples}}"
    answer = Simulator(command).readings(read(off).samples)
    expected = np.array([arm().reflector_m(q) for q in poses()])
    assert np.stack([answer[name] for name in ("x_m", "y_m", "z_m")], axis=1) == pytest.approx(expected, abs=1e-12)


def test_a_tracker_at_another_place_is_six_numbers_and_no_mismatch(tmp_path):
    turn, shift = Rotation.from_rotvec([0.05, 0.1, -0.9]), np.array([-1.0, 2.0, 0.2])
    moved = turn * TRACKER[0], TRACKER[1] + shift
    measured = session(tmp_path / "measured", poses(), poses(), arm(), seed=1, tracker=moved)
    simulated = session(tmp_path / "simulated", poses(), poses(), arm(), seed=2)
    said = compared(tmp_path, measured, simulated)
    (frame,) = said["differences"]
    assert (frame["level"], frame["where"], frame["decides"]) == ("frames", "device.pose", False)
    truth = dict(zip([f"shift_{a}_m" for a in "xyz"], shift, strict=True))
    truth |= dict(zip([f"turn_{a}_rad" for a in "xyz"], turn.as_rotvec(), strict=True))
    assert set(frame["sizes"]) == set(truth)
    assert all(near(frame["sizes"][name], value) for name, value in truth.items())
    assert said["verdict"] == "consistent"
    assert said["first_link"] is None


def test_rig_files_that_differ_are_named_first_key_by_key(tmp_path, capsys):
    text = (EXAMPLES / "rig.toml").read_text(encoding="utf-8")
    other = text.replace("d_m = 0.1333", "d_m = 0.1233")
    measured = session(tmp_path / "measured", poses(), poses(), arm(), seed=1)
    simulated = session(tmp_path / "simulated", poses(), poses(), arm(), seed=2, rig=other)
    said = compared(tmp_path, measured, simulated, "--no-diagnose")
    first = said["differences"][0]
    assert (first["level"], first["where"]) == ("rig", "arm.joint 4.d_m")
    assert said["rig"][0]["difference"] == pytest.approx(0.01)
    assert said["verdict"] == "mismatch"
    printed = " ".join(capsys.readouterr().out.split())
    assert "arm.joint 4.d_m: 0.1333 measured, 0.1233 simulated (measured less simulated +10.0 mm)" in printed


def test_servo_corrections_and_zeros_of_second_encoders_are_no_mismatch(tmp_path):
    """A servo has moved every joint by some milliradians; second encoders count from wherever they were mounted."""
    rng, zeros = np.random.default_rng(7), {"measured": 2.61, "simulated": -0.4}
    folders = []
    for seed, (name, zero_rad) in enumerate(zeros.items(), start=1):
        q_rad = poses() + rng.normal(0.0, 4e-3, (SAMPLES, 6)) * (name == "measured")
        seen = q_rad + zero_rad + rng.normal(0.0, 2e-6, q_rad.shape)
        encoders = {f"enc{j + 1}_rad": seen[:, j] for j in range(6)}
        folders.append(session(tmp_path / name, q_rad, q_rad, arm(), seed=seed, **encoders))
    said = compared(tmp_path, *folders)
    assert said["matched"] == SAMPLES
    (zero,) = said["differences"]
    assert (zero["level"], zero["decides"]) == ("encoder-zeros", False)
    assert all(near(size, 3.01) for size in zero["sizes"].values())
    assert len(zero["sizes"]) == 6
    assert said["verdict"] == "consistent"
    assert said["first_link"] is None


@pytest.mark.endure
def test_another_zero_of_degrees_does_not_break_a_match_and_is_sized(tmp_path):
    measured = session(
        tmp_path / "measured", poses() + np.array([0.0, 2.6, 0.0, 0.0, 0.0, 0.0]), poses(), arm(), seed=1
    )
    simulated = session(tmp_path / "simulated", poses(), poses(), arm(), seed=2)
    said = compared(tmp_path, measured, simulated)
    assert said["matched"] == SAMPLES
    found = deciding(said)
    assert set(found) == {"joint2.angle"}
    assert near(found["joint2.angle"]["sizes"]["zero_rad"], -2.6)


def test_a_mismatch_ends_with_1_where_that_is_asked_for(off, tmp_path, capsys):
    simulated, out = session(tmp_path / "simulated", poses(), poses(), arm()), tmp_path / "compare.json"
    asked = ["--no-diagnose", "--out", str(out)]
    assert run(["compare", str(off), str(simulated), *asked]) == 0
    said = out.read_bytes()
    out.unlink()
    assert run(["compare", str(off), str(simulated), *asked, "--exit-code"]) == 1
    assert out.read_bytes() == said
    assert json.loads(said)["verdict"] == "mismatch"
    assert "differ" in capsys.readouterr().err


ANSWERS = {
    "code 3": ("import sys; sys.stderr.write('no licence\\n'); sys.exit(3)", "ended with code 3: no licence"),
    "column": ("print('x_m,y_m')", "column z_m is missing"),
    "rows": ("print('x_m,y_m,z_m\\n1,2,3')", "1 rows for 60 samples"),
    "nan": ("print('x_m,y_m,z_m'); print('1,nan,3\\n' * 60)", "row 1, column y_m: 'nan'"),
    "word": ("print('x_m,y_m,z_m'); print('1,two,3\\n' * 60)", "row 1, column y_m: 'two' is no number"),
    "hang": ("import threading; threading.Event().wait()", "no answer within 0.1 s"),
}


@pytest.mark.parametrize("program", ANSWERS)
def test_a_program_that_answers_wrongly_is_one_message(program, off, tmp_path, capsys):
    text, says = ANSWERS[program]
    (tmp_path / "sim.py").write_text(text, encoding="utf-8")
    command = [
        "--simulator",
        f"{sys.executable} {tmp_path / 'sim.py'}",
        "--timeout-s",
        "0.1" if program == "hang" else "30",
    ]
    assert run(["compare", str(off), *command, "--out", str(tmp_path / "c.json")]) == 1
    error = capsys.readouterr().err
    assert says in error
    assert "Traceback" not in error
    assert not (tmp_path / "c.json").exists()


def test_a_model_is_a_simulation_whose_own_uncertainty_is_no_difference(tmp_path):
    """The example of `compare --help`."""
    measured = session(tmp_path / "measured", poses(), poses(), arm(A_M=[0.0, 4e-4, 0.0, 0.0, 0.0, 0.0]))
    model = tmp_path / "model.json"
    assert run(["identify", str(measured), "--out", str(model)]) == 0
    said = compared(tmp_path, measured, "--simulated-model", model)
    assert said["verdict"] == "consistent"
    assert said["differences"] == []


def test_a_simulation_has_to_be_given_once(off, capsys):
    assert run(["compare", str(off)]) == 1
    assert "no simulation" in capsys.readouterr().err
    assert run(["compare", str(off), str(off), "--simulator", "x"]) == 1
    assert "not both" in capsys.readouterr().err


def test_a_program_that_is_not_there_is_one_message(off, capsys):
    assert shutil.which("no-such-simulator") is None
    assert run(["compare", str(off), "--simulator", "no-such-simulator"]) == 1
    assert "cannot be started" in capsys.readouterr().err
