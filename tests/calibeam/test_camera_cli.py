"""`calibeam camera` on emulated devices, and a session that aims by what it measured."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from acquisition.recording import RecordingWriter, RigFileError, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from calibeam.cli import run
from calibeam.devices.instruments import camera_sight
from calibeam.devices.recorder import record_session
from calibeam.devices.site import addresses_of, connected
from calibeam.emulation import Emulation
from calibeam.printing.progress import progress_bar
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd-camera.toml"
PACE = 6.0  # emulated seconds in one
TINY = PlanOptions(centred=1, off_centre=0, repeats=0)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Emulation]]:
    """A rig file whose controller and camera are emulated ones that run, its camera measured."""
    folder = tmp_path_factory.mktemp("site")
    with Emulation(RIG, seed=2, time_scale=PACE) as emulation:
        text = RIG.read_text().replace('host = "127.0.0.2"', f'host = "{emulation.address["robot"]["host"]}"')
        text = text.replace("http://127.0.0.1:8071/image.jpg", emulation.address["camera"]["source"])
        text = text.replace("out/emulated/psd", emulation.address["psd"]["port"])
        text = text.replace("out/emulated/can", emulation.address["can"]["channel"])
        path = folder / "rig.toml"
        path.write_text(text.replace("out/camera/camera.json", str(folder / "camera" / "camera.json")))
        assert run(["camera", str(path), "--out", str(folder / "camera"), "--time-scale", str(PACE), "--yes"]) == 0
        yield path, emulation


def test_the_file_says_how_good_it_is(site) -> None:
    said = json.loads((site[0].parent / "camera" / "camera.json").read_text())
    assert said["kind"] == "calibeam-camera"
    assert said["views"] >= 8
    assert said["reprojection_px"] < 0.5
    assert said["board_m"] < 0.02
    assert said["lit"] >= 4
    assert said["beam_m"] < 2e-3
    assert said["beam_rad"] < 0.02


def test_a_session_comes_to_light_by_camera(site, tmp_path: Path) -> None:
    path, emulation = site
    rig, clock = load_rig(path), SystemClock()
    one_place = msgspec.structs.replace(rig, placement_list=rig.placement_list[:1])
    recording = tmp_path / "recording.mcap"
    with (
        RecordingWriter(recording, rig_text=rig_text(path), software="test", clock=clock) as writer,
        camera_sight(rig, clock) as sight,
        connected(rig, addresses_of(rig, emulation.address, PACE), writer, clock, emulation.place_fixture) as bench,
    ):
        summary = record_session(bench, one_place, writer, TINY, clock, progress_bar(Console(quiet=True)), sight=sight)
    assert len(summary.samples) == 2
    kinds = [event.kind for event in read(recording).events]
    assert "search" not in kinds


def test_the_check_tries_the_camera_too(site, capsys) -> None:
    assert run(["check", str(site[0])]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("camera")]
    assert re.search(r"camera +ok +960 x 720 from http.*image.jpg, \d+ Hz, board (in \d of 3|not in the) picture", line)


def test_a_camera_that_was_not_measured_is_refused_with_the_remedy() -> None:
    rig = load_rig(RIG)
    unmeasured = msgspec.structs.replace(rig, camera=msgspec.structs.replace(rig.camera, calibration=None))
    with pytest.raises(RigFileError, match="calibeam camera"), camera_sight(unmeasured, SystemClock()):
        pass
