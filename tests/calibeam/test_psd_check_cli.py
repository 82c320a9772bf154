"""`calibeam psd-check` on two emulated KPA101, and what a rig file says of detectors."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibeam.commands import psd_check
from calibeam.devices.instruments import emulated_psd, psd_driver, psd_view
from drivers.clock import SystemClock
from drivers.errors import DeviceRefused
from drivers.psd_error_map import ErrorMap
from drivers.psd_faces import FaceKind
from simulators.host.loop import Host
from simulators.kpa101.emulator import build

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs" / "ur5e-dual-kpa101.toml"
LENGTH_M = 0.02  # the rig's half_size_m, twice
STEPS_M = (-6e-3, -2e-3, 2e-3, 6e-3)
PLACES_M = [(x, y) for x in STEPS_M for y in STEPS_M]


class Bench:
    """A spot that a test moves; the face shows it 2 % short in x."""

    psd_temperature_degC = 20.0

    def __init__(self) -> None:
        self.time_s = 0.0
        self.place_m = (0.0, 0.0)

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        """No noise here."""

    def photocurrents_a(self, times_s: np.ndarray) -> np.ndarray:
        right, top = 0.5 + 0.98 * self.place_m[0] / LENGTH_M, 0.5 + self.place_m[1] / LENGTH_M
        face = [4e-5 * (1.0 - right), 4e-5 * right, 4e-5 * (1.0 - top), 4e-5 * top]
        return np.tile([*face, *face], (len(times_s), 1))


@pytest.fixture
def bench(tmp_path, monkeypatch) -> Iterator[Bench]:
    """Emulated units at the links that the rig names, in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    world = Bench()
    ports = ["out/emulated/psd1", "out/emulated/psd2"]
    host = Host(build(world, {"devices": {"psd": {"ports": ports}}}), world, time_scale=4.0)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield world
    finally:
        stop.set()
        thread.join()
        host.close()


@pytest.fixture
def places(tmp_path) -> Path:
    path = tmp_path / "points.csv"
    path.write_text("x_m,y_m\n" + "".join(f"{x},{y}\n" for x, y in PLACES_M))
    return path


def test_signs_scale_and_map_are_measured_and_used(bench, places, tmp_path, monkeypatch, capsys):
    def move(number: int, place) -> None:
        bench.place_m = tuple(place)

    monkeypatch.setattr(psd_check, "_say_nothing", move)
    monkeypatch.setattr(psd_check, "READ_S", 0.1)
    out = tmp_path / "psd2.json"
    assert run(["psd-check", str(RIG), "--points", str(places), "--unit", "2", "--out", str(out), "--no-wait"]) == 0
    text = capsys.readouterr().out
    assert "unit 2: x_signs -1, as in the rig" in text
    assert "unit 2: y_signs 1, as in the rig" in text
    assert "error map: gain 1.02" in text
    assert "as in the rig" in text.split("sum_full_scale_v")[1]
    measured = ErrorMap.load(out)
    x_m, y_m = measured.correct(0.98 * 5e-3, -4e-3)
    np.testing.assert_allclose([x_m, y_m], [5e-3, -4e-3], atol=2e-6)


def test_a_rig_with_the_wrong_sign_is_corrected(bench, places, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(psd_check, "_say_nothing", lambda number, place: setattr(bench, "place_m", tuple(place)))
    monkeypatch.setattr(psd_check, "READ_S", 0.1)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(
        RIG.read_text().replace("x_signs = [-1, -1]", "x_signs = [1, -1]").replace("[10.0, 10.0]", "[40.0, 10.0]")
    )
    made = tmp_path / "map.json"
    assert run(["psd-check", str(wrong), "--points", str(places), "--unit", "1", "--out", str(made), "--no-wait"]) == 1
    text, error = capsys.readouterr()
    assert "first, then measure the map again" in " ".join(error.split())
    assert not made.exists()
    assert "unit 1: x_signs -1, the rig file has 1: correct x_signs" in text
    assert "the rig file has 40: correct sum_full_scale_v" in text


@pytest.mark.parametrize(
    ("text", "says"),
    [("a,b\n1,2\n", "needs columns x_m, y_m"), ("x_m,y_m\n", "no places"), ("x_m,y_m\n1,\n", "columns")],
)
def test_bad_points_are_one_sentence(tmp_path, capsys, text, says):
    (tmp_path / "points.csv").write_text(text)
    assert run(["psd-check", str(RIG), "--points", str(tmp_path / "points.csv")]) == 1
    assert says in capsys.readouterr().err


def test_the_view_of_a_pair_uses_the_maps_of_the_rig(bench, tmp_path):
    from msgspec import structs

    rig = load_rig(RIG)
    held = ErrorMap(0.01, (1e-3, 0.01, 0.0, 0.0, 0.0), (0.0, 0.01, 0.0, 0.0, 0.0), (0.0,) * 5, (0.0,) * 5, 1.0)
    (tmp_path / "psd1.json").write_text(held.text())
    device = structs.replace(rig.devices.psd, error_maps=("psd1.json", ""))
    psd = psd_driver(emulated_psd(device, {"ports": ["out/emulated/psd1", "out/emulated/psd2"]}), rig, SystemClock())
    with pytest.raises(DeviceRefused, match="connect it first"):
        psd_view(psd, device)
    psd.connect()
    try:
        view = psd_view(psd, device)
        bench.place_m = (2e-3, 1e-3)
        psd.read(2.0)
        one, other = view.mean(psd_check.psd_window([psd.read(2.0), psd.read(2.0)]))
    finally:
        psd.close()
    assert [face.kind for face in view.faces] == [FaceKind.PIN_CUSHION] * 2
    np.testing.assert_allclose([one.x_m, one.y_m], [0.98 * 2e-3 + 1e-3, 1e-3], atol=2e-6)
    np.testing.assert_allclose([other.x_m, other.y_m], [0.98 * 2e-3, 1e-3], atol=2e-6)
    with pytest.raises(DeviceRefused, match=r"none.json"):
        psd_view(psd, structs.replace(device, error_maps=("", "none.json")))
