"""`calibeam live` from the command line: an address, an end, and devices that are not there."""

import json
import threading
from pathlib import Path

import pytest

from calibeam.cli import run
from calibeam.live.devices import Watched, devices_of, reading
from drivers.clock import SystemClock
from drivers.errors import DeviceLost

ROOT = Path(__file__).parents[3]


def rig_without(text: str, tmp_path: Path, *sections: str) -> Path:
    """The shipped rig without these sections, and with ports that lead nowhere."""
    kept, skipping = [], False
    for line in text.replace("out/emulated", str(tmp_path / "nowhere")).splitlines():
        skipping = line.strip("[]") in sections if line.startswith("[") else skipping
        kept += [] if skipping else [line]
    path = tmp_path / "rig.toml"
    path.write_text("\n".join(kept))
    return path


@pytest.fixture
def text() -> str:
    return (ROOT / "rigs" / "ur5e-dual-psd.toml").read_text()


def test_it_prints_where_the_page_is_and_ends(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rig = rig_without(text, tmp_path, "devices.robot")
    assert run(["live", str(rig), "--port", "0", "--for-s", "0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["url"].startswith("http://127.0.0.1:")


def test_a_rig_without_devices_is_reported(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rig = rig_without(text, tmp_path, "devices.robot", "devices.psd", "devices.encoders")
    assert run(["live", str(rig), "--port", "0", "--for-s", "0"]) == 1
    assert "no [devices]" in capsys.readouterr().err


def test_a_device_that_is_away_is_tried_again_until_the_end(rig, latest) -> None:
    class Away:
        name = "psd"
        tried = threading.Event()

        def connect(self) -> None:
            self.tried.set()
            raise DeviceLost("psd: no such port; plug it in")

        def describe(self) -> tuple: ...
        def read(self, timeout_s: float) -> None: ...
        def close(self) -> None: ...

    away = Away()
    with reading([Watched(away)], latest):  # pyright: ignore[reportArgumentType]
        assert away.tried.wait(5.0)
    assert latest.of("psd").why == "psd: no such port; plug it in"
    assert [line.text for line in latest.lines] == ["psd: no such port; plug it in"]


def test_a_device_that_fails_at_every_step_is_still_tried_again(rig, latest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("calibeam.live.devices.AGAIN_S", 0.0)

    class Failing:
        name = "psd"
        tries = 0
        again = threading.Event()

        def connect(self) -> None:
            self.tries += 1
            if self.tries > 2:
                self.again.set()

        def describe(self) -> tuple: ...
        def read(self, timeout_s: float) -> None: ...

        def close(self) -> None:
            raise OSError("the port is gone")

    def unseen() -> None:
        raise ValueError("an error map that does not fit")

    failing = Failing()
    with reading([Watched(failing, unseen)], latest):  # pyright: ignore[reportArgumentType]
        assert failing.again.wait(5.0)
    assert "an error map that does not fit" in (latest.of("psd").why or "")


def test_the_devices_are_those_of_the_rig_and_stop_has_a_way_to_the_arm(rig, latest) -> None:
    watched = devices_of(rig, SystemClock(), latest)
    assert {one.device.name for one in watched} == {"psd", "encoders", "robot"}
    assert latest.stop.ready
