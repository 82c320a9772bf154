"""The package of the documentation, installed into a temporary folder: its device and its effect, no edit of ours."""

import importlib
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from acquisition.recording.rig import parse_rig, rig_text
from calibeam.devices.check import check_devices
from calibeam.devices.others import DeviceKind, emulated_others, other_drivers
from calibrate.effects.kind import Kind
from calibrate.plug_ins import DEVICES, EFFECTS, loaded, plug_ins
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


@pytest.fixture
def installed(site_packages: Path) -> Path:
    for module in (*PACKAGE.glob("*.py"), ROOT / "docs" / "examples" / "balancer_pull.py"):
        shutil.copy(module, site_packages)
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    install(site_packages, project, project["entry-points"])
    return site_packages


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
    says = "from calibrate.effects.catalogue import EFFECTS; print(EFFECTS[-1].physics)"
    paths = os.pathsep.join((str(installed), str(ROOT)))
    out = subprocess.run(
        [sys.executable, "-c", says],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert out.stdout.strip() == "balancer-pull"
    assert out.stderr == ""


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
    assert "wrong_lab:KIND is a int, not a calibrate.effects.kind.Kind; it is left out" in wrong
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
