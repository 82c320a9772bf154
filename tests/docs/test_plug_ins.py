"""The package of the documentation, installed into a temporary folder: its device and its effect, no edit of ours."""

import csv
import importlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import parse_rig, rig_text
from acquisition.recording.session_folder import write_csv
from calibeam.devices.check import check_devices
from calibeam.devices.others import DeviceKind, emulated_others, other_drivers
from calibrate.apply.export.export import FORMS, FormName, form_named
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.effects.kind import Kind
from calibrate.model.model_file import read_model
from calibrate.plug_ins import (
    DEVICES,
    EFFECTS,
    loaded,
    plug_ins,
)
from drivers.clock import SystemClock
from drivers.errors import DeviceRefused
from simulators.devices import plug_in_bench
from simulators.errors import HostError
from simulators.host.loop import Host

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "docs" / "examples" / "lab-thermometer"
RIG = rig_text(ROOT / "rigs" / "ur5e-tracker.toml")
OTHER = """
[[devices.other]]
name = "hall"
driver = "lab-thermometer"
settings = { host = "127.0.0.1", port = 4000 }
"""


@pytest.fixture
def site_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A folder that Python finds packages in; what was imported from it is forgotten at the end."""
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def install(folder: Path, project: dict, entries: dict[str, dict[str, str]]) -> None:
    """What an installer leaves of a package beside its modules."""
    info = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = (f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in each.items()) for group, each in entries.items())
    (info / "entry_points.txt").write_text("\n".join(groups))
    importlib.invalidate_caches()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the package, as its own pyproject.toml has it built."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*build, "-w", str(folder), str(PACKAGE)], check=True)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture
def installed(site_packages: Path, wheel: Path) -> Path:
    zipfile.ZipFile(wheel).extractall(site_packages)
    importlib.invalidate_caches()
    return site_packages


def in_a_fresh_interpreter(installed: Path, says: str, *words: str) -> str:
    """Standard output of a program in a Python that finds the package; nothing may stand on standard error."""
    out = subprocess.run(
        [sys.executable, "-c", says, *words],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(installed), str(ROOT)))},
    )
    assert (out.returncode, out.stderr) == (0, "")
    return out.stdout


class World:
    time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s


def test_its_driver_reads_its_emulator(installed: Path) -> None:
    rig, world = parse_rig(RIG + OTHER, "rig.toml"), World()
    bench = plug_in_bench(world, {"name": "hall", "driver": "lab-thermometer", "settings": {}})
    assert bench is not None
    host = Host(bench, world)
    try:
        address, port = host.tcp_address("lab-thermometer")
        (there,) = emulated_others(rig.devices.others, {"hall": {"host": address, "port": port}})
        (other,) = other_drivers([there], SystemClock())
        assert other.package == "lab-thermometer 1.0"
        other.device.connect()
        for _ in range(3):
            host.turn(0.01)
        block = other.device.read(2.0)
        assert block.values["temperature_degC"].tolist() == [21.5]
        other.device.close()
    finally:
        host.close()


def test_its_effect_is_in_the_catalogue_of_a_fresh_interpreter(installed: Path) -> None:
    says = "from calibrate.model.effects.catalogue import EFFECTS; print(EFFECTS[-1].physics)"
    assert in_a_fresh_interpreter(installed, says).strip() == "balancer-pull"


LAB = (ROOT / "docs" / "examples" / "lab" / "rig.toml").read_text()
LONGER_M = 4e-4  # of link 2, against the drawing
COMMANDS = """
import sys
from calibeam.cli import run
folder = sys.argv[1]
assert run(["identify", f"{folder}/session", "--out", f"{folder}/model.json", "--export", "pykdl"]) == 0
samples, predicted = f"{folder}/session/samples.csv", f"{folder}/predicted.csv"
assert run(["predict", f"{folder}/model.json", samples, "--out", predicted]) == 0
assert run(["export-model", f"{folder}/model.json", "--to", "pykdl", "--out", f"{folder}/arm.py"]) == 0
"""


@pytest.fixture(scope="module")
def exported(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a session of heights over a tilted plate, and what the commands made of it."""
    installed = tmp_path_factory.mktemp("site-packages")
    zipfile.ZipFile(wheel).extractall(installed)
    rng = np.random.default_rng(3)
    q_rad = rng.uniform(-1.5, 1.5, (150, 6))
    true = RigArm.of_rig(parse_rig(LAB.replace("a_m = -0.425", f"a_m = {-0.425 - LONGER_M}"), "rig.toml"))
    normal = Rotation.from_rotvec([0.01, -0.02, 0.0]).apply([0.0, 0.0, 1.0])
    height_m = 0.7 + true.tip_m(q_rad) @ normal + rng.normal(0.0, 5e-6, len(q_rad))
    columns = {"t_s": np.arange(150.0)} | {f"q{j + 1}_rad": angle for j, angle in enumerate(q_rad.T)}
    folder = tmp_path_factory.mktemp("lab")
    (folder / "session").mkdir()
    (folder / "session" / "rig.toml").write_text(LAB, encoding="utf-8")
    write_csv(Samples(columns | {"height_m": height_m}, 6), folder / "session" / "samples.csv")
    in_a_fresh_interpreter(installed, COMMANDS, str(folder))
    return folder


def test_its_sensor_identifies_an_arm_and_its_readings_are_predicted(exported: Path) -> None:
    model = json.loads((exported / "model.json").read_text())
    assert model["instruments"] == ["height"]
    length = next(p for p in model["parameters"] if p["name"] == "link2.length")
    assert length["value"] == pytest.approx(-LONGER_M, abs=4.0 * length["sigma"])
    assert length["sigma"] < 5e-5
    with (exported / "predicted.csv").open() as file:
        left_m = [float(row["r_height_m"]) for row in csv.DictReader(file)]
    assert np.sqrt(np.mean(np.square(left_m))) < 6e-6


class Kdl:
    """What the exported module uses of PyKDL, on plain matrices; the end of the chain at joint angles."""

    class Joint(str):
        Fixed, RotZ = "fixed", "rot-z"

    def __init__(self) -> None:
        self.segments: list[tuple[str, np.ndarray]] = []
        self.Chain, self.addSegment = (lambda: self), self.segments.append

    def Rotation(self, *numbers: float) -> np.ndarray:
        return np.reshape(numbers, (3, 3))

    def Vector(self, *numbers: float) -> np.ndarray:
        return np.array(numbers)

    def Frame(self, rotation: np.ndarray, origin: np.ndarray) -> np.ndarray:
        return np.block([[rotation, origin[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])

    def Segment(self, joint: str, frame: np.ndarray) -> tuple[str, np.ndarray]:
        return joint, frame

    def end(self, q_rad: np.ndarray) -> np.ndarray:
        T, angles = np.eye(4), iter(q_rad)
        for joint, frame in self.segments:
            if joint == self.Joint.RotZ:
                T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, next(angles)]).as_matrix()
            T = T @ frame
        return T


def test_its_export_form_writes_the_identified_arm(exported: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (exported / "arm.py").read_text()
    assert text == (exported / "model.kdl.py").read_text()
    kdl = Kdl()
    monkeypatch.setitem(sys.modules, "PyKDL", kdl)
    exec(compile(text, "arm.py", "exec"), {})
    q_rad = np.random.default_rng(5).uniform(-2.0, 2.0, (20, 6))
    chain = json.loads((exported / "model.json").read_text())["chain"]
    arm = RigArm.of_rig(parse_rig(LAB, "rig.toml"), chain)
    np.testing.assert_allclose([kdl.end(q) for q in q_rad], arm.frames(q_rad)[:, -1], atol=1e-12)


def test_a_model_of_a_sensor_that_is_not_installed_is_refused_with_the_name(exported: Path) -> None:
    with pytest.raises(DataError, match="no sensor is called 'height' here; install what brings it"):
        read_model(exported / "model.json")


def test_a_form_that_nobody_brings_is_named_with_those_there_are(site_packages: Path) -> None:
    with pytest.raises(DataError, match=r"no form of export is called 'pykdl'; choose one of urdf, .*table"):
        form_named("pykdl")


def test_the_words_of_the_command_line_are_those_of_the_forms() -> None:
    assert get_args(FormName) == tuple(form.name for form in FORMS)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ('{ host = "a", port = 1, colour = "red" }', "has no setting 'colour'"),
        ('{ host = "a", port = "one" }', "settings of .*Expected `int`, got `str`"),
        ('{ host = "a" }', "missing required field `port`"),
    ],
)
def test_settings_that_the_package_does_not_take(installed: Path, settings: str, says: str) -> None:
    rig = parse_rig(RIG + OTHER.replace('{ host = "127.0.0.1", port = 4000 }', settings), "rig.toml")
    with pytest.raises(DeviceRefused, match=f"hall: .*{says}"):
        other_drivers(rig.devices.others, SystemClock())


def test_a_broken_package_is_named_once_and_left_out(site_packages: Path, capsys: pytest.CaptureFixture) -> None:
    (site_packages / "broken_lab.py").write_text("import no_such_module\n")
    (site_packages / "wrong_lab.py").write_text("KIND = 7\n")
    entries = {
        DEVICES: {"lab-thermometer": "broken_lab:KIND"},
        "calibeam.test-effects": {"broken": "broken_lab:EFFECT", "wrong": "wrong_lab:KIND"},
    }
    install(site_packages, {"name": "broken-lab", "version": "0.3"}, entries)
    assert loaded("calibeam.test-effects", Kind) == loaded("calibeam.test-effects", Kind) == ()
    broken, wrong = capsys.readouterr().err.splitlines()
    assert "'broken' (calibeam.test-effects) of the package broken-lab 0.3 cannot be loaded: ModuleNotFound" in broken
    assert "wrong_lab:KIND is a int, not a calibrate.model.effects.kind.Kind; it is left out" in wrong
    rig = parse_rig(RIG + OTHER, "rig.toml")  # a rig that names it is read, and whoever needs it is told
    with pytest.raises(DeviceRefused, match=r"hall: plug-in 'lab-thermometer' .* package broken-lab 0.3 cannot be loa"):
        other_drivers(rig.devices.others, SystemClock())
    with pytest.raises(HostError, match=r"hall: the emulator of the package broken-lab 0.3 cannot be made"):
        plug_in_bench(World(), {"name": "hall", "driver": "lab-thermometer"})


def test_a_driver_that_nobody_brings(site_packages: Path) -> None:
    rig = parse_rig(RIG.split("[devices.robot]")[0] + OTHER, "rig.toml")
    with pytest.raises(DeviceRefused, match=r"hall: no installed package brings the driver 'lab-thermometer'"):
        other_drivers(rig.devices.others, SystemClock())
    (found,) = check_devices(rig, SystemClock())
    assert found.device == "hall"
    assert "install it" in found.wrong


def test_names_of_further_instruments_are_their_own() -> None:
    from acquisition.recording import RigFileError

    with pytest.raises(RigFileError, match=r"'robot' in .*is taken"):
        parse_rig(RIG + OTHER.replace('"hall"', '"robot"'), "rig.toml")
    with pytest.raises(RigFileError, match=r"'hall' in .*is taken"):
        parse_rig(RIG + OTHER + OTHER, "rig.toml")


def test_the_command_line_looks_nothing_up() -> None:
    says = "import sys, calibeam.cli; print('calibrate.plug_ins' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", says], capture_output=True, text=True, check=True, cwd=ROOT)
    assert out.stdout.strip() == "False"


def test_the_kind_is_what_the_page_says(installed: Path) -> None:
    (one,) = [one for one in plug_ins(DEVICES) if one.name == "lab-thermometer"]
    kind = one.load(lambda found: isinstance(found, DeviceKind), "a DeviceKind")
    assert isinstance(kind, DeviceKind)
    assert kind.silence_s == 3.0
    assert [one.name for one in plug_ins(EFFECTS)] == ["balancer-pull"]
