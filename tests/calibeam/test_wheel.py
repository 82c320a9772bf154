"""What `pip install calibeam` brings: every file that the program reads stands in the wheel."""

import json
import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from calibeam.cli import EXTRAS

ROOT = Path(__file__).parents[2]
PROBE = """
import calibeam.commands.demo as demo, calibeam.rig_files as files
from acquisition.recording.rig import load_rig
assert str(files.RIGS).startswith({where!r}), files.RIGS
print(load_rig(demo.RIG).name)
"""


def _built(folder: Path) -> Path:
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*build, "-w", str(folder / "wheel"), str(ROOT)], check=True)
    (wheel,) = (folder / "wheel").glob("*.whl")
    return wheel


def test_an_installed_wheel_has_its_own_rigs_and_everything_the_checkout_has(tmp_path: Path) -> None:
    """Unpacked beside nothing else, it loads the rig of the demo from itself."""
    wheel = _built(tmp_path)
    installed = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(installed)
    tracked = subprocess.run(["git", "ls-files", "calibeam"], cwd=ROOT, capture_output=True, text=True, check=True)
    missing = [name for name in tracked.stdout.split() if not (installed / name).exists() and (ROOT / name).exists()]
    assert missing == []
    probe = PROBE.format(where=str(installed))
    done = subprocess.run(
        [sys.executable, "-c", probe], cwd=tmp_path, env={"PYTHONPATH": str(installed)}, capture_output=True, text=True
    )
    assert done.stdout.strip() == "ur5e-dual-psd", done.stderr


WHERE = """
import calibeam, calibeam.rig_files as files, json
print(json.dumps([calibeam.__file__, str(files.RIGS), sorted(path.name for path in files.RIGS.glob("*.toml"))]))
"""


@pytest.mark.endure  # five minutes: an environment of its own, and the demo in it, whose arms nobody has compiled
@pytest.mark.timeout(900)
def test_the_wheel_does_the_main_job_in_an_environment_without_extras(tmp_path: Path) -> None:
    """Installed by pip away from the checkout, with the libraries of this environment but those of extras."""
    fresh = tmp_path / "fresh"
    venv.create(fresh, with_pip=False)
    python = fresh / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*install, "--disable-pip-version-check", str(_built(tmp_path))], check=True)
    (site,) = fresh.glob("lib/python*/site-packages")
    # A path in a .pth file is searched, but the .pth files in it are not read: so not that of the checkout either.
    blocked = f"import sys; sys.modules.update(dict.fromkeys({sorted(EXTRAS)}))"
    (site / "others.pth").write_text(f"{sysconfig.get_path('purelib')}\n{blocked}\n")
    empty_folder = tmp_path / "elsewhere"
    empty_folder.mkdir()
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV", "COV"))}

    def said(*command: str | Path) -> str:
        done = subprocess.run(command, cwd=empty_folder, env=plain, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    program, rigs, names = json.loads(said(python, "-c", WHERE))
    assert Path(program).is_relative_to(site)
    assert Path(rigs).is_relative_to(site)
    assert names == sorted(path.name for path in (ROOT / "rigs").glob("*.toml"))
    calibeam = fresh / "bin" / "calibeam"
    assert said(calibeam, "--version").strip() == version("calibeam")
    assert "Universal Robots UR5e" in said(calibeam, "rig", "list")
    said(calibeam, "demo", "--out", empty_folder / "demo")
    assert {"recording.mcap", "report.html"} <= {path.name for path in (empty_folder / "demo").iterdir()}
