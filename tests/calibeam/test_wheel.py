"""What `pip install calibeam` brings: every file that the program reads stands in the wheel."""

import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROBE = """
import calibeam.commands.demo as demo, calibeam.rig_files as files
from acquisition.recording.rig import load_rig
assert str(files.RIGS).startswith({where!r}), files.RIGS
print(load_rig(demo.RIG).name)
"""


def test_an_installed_wheel_has_its_own_rigs_and_everything_the_checkout_has(tmp_path: Path) -> None:
    """Unpacked beside nothing else, it loads the rig of the demo from itself."""
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*build, "-w", str(tmp_path / "wheel"), str(ROOT)], check=True)
    (wheel,) = (tmp_path / "wheel").glob("*.whl")
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
