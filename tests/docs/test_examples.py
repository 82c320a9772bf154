"""The worked examples of the documentation do what their pages say."""

import importlib.util
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import read
from calibeam.cli import run
from calibeam.results.diagnosis import diagnose_to_file
from calibrate.diagnose.record import to_file
from calibrate.model.effects import catalogue
from calibrate.model.effects.term import UNITS
from calibrate.model.model_file import read_model
from drivers.errors import DeviceLost, DeviceStale, WireError
from drivers.transports.serial_port import SerialAddress, open_serial
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
GIVE_RAD = 3e-4  # of joint 2 for 1 MPa, arm level


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def with_pressure(recording, give_rad):
    """The session as a controller would have written it whose joint 2 gives way unseen."""
    samples, rng = recording.samples, np.random.default_rng(3)
    pressure_pa = 8e6 + np.cumsum(rng.normal(0.0, 1e5, len(samples)))
    q_rad = samples.column("q2_rad")
    seen = q_rad - give_rad * (pressure_pa - pressure_pa.mean()) / 1e6 * np.cos(q_rad)
    columns = {**samples.columns, "q2_rad": seen, "balancer_pa": pressure_pa}
    return replace(recording, samples=replace(samples, columns=columns))


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tracker")
    write_case(conceal(Wanted("tracker", 11, samples=150)), folder)
    return read(folder / "recording")


@pytest.fixture
def with_the_effect(monkeypatch):
    """The one line in the catalogue."""
    effects = (*catalogue.EFFECTS, example("balancer_pull").EFFECT)
    monkeypatch.setattr(catalogue, "EFFECTS", effects)
    monkeypatch.setattr(to_file, "EFFECTS", effects)


def test_an_effect_of_one_file_is_found_and_measured(session, with_the_effect, tmp_path):
    _, file = diagnose_to_file(with_pressure(session, GIVE_RAD), tmp_path / "diagnosis.json")
    (found,) = [f for f in file.findings if f.physics == "balancer-pull"]
    assert found.where == "joint2.angle"
    give = found.parameters["give_level_rad"]
    assert give.value == pytest.approx(GIVE_RAD, abs=4.0 * give.sigma)
    assert give.sigma < 0.1 * GIVE_RAD


def test_it_is_not_claimed_where_nothing_gives_way(session, with_the_effect, tmp_path):
    _, file = diagnose_to_file(with_pressure(session, 0.0), tmp_path / "diagnosis.json")
    assert "balancer-pull" not in {f.physics for f in file.findings}


def test_its_sizes_have_units_that_a_person_reads():
    endings = tuple(ending for ending, _ in UNITS)
    for name in ("give_level_rad", "give_upright_rad"):
        assert name.endswith(endings)


@pytest.fixture
def line():
    """The instrument's end of a serial line, and the port at the other."""
    instrument, port = os.openpty()
    yield instrument, os.ttyname(port)
    os.close(port)
    os.close(instrument)


def thermometer(port):
    module = example("thermometer")
    return module.Thermometer(lambda: open_serial(SerialAddress(port=port), module.BAUD))


class Talking:
    """A line in memory: what the instrument sends, piece by piece, cut where it likes."""

    name = "thermometer's line"

    def __init__(self, pieces):
        self._pieces = list(pieces)

    def read(self, max_bytes, timeout_s):
        return self._pieces.pop(0)

    def close(self):
        pass


def test_a_thermometer_of_one_file_is_recorded(tmp_path):
    module, out = example("thermometer"), tmp_path / "thermometer.mcap"
    device = module.Thermometer(lambda: Talking([b"23.41\r\n23.4", b"2\r\n", b"\r\n", b"23.43\n"]))
    module.record(device, EXAMPLES / "lab" / "rig.toml", out, samples=3)
    stream = read(out).streams["thermometer"]
    assert stream.values["temperature_degC"].tolist() == [23.41, 23.42, 23.43]
    assert stream.sequence.tolist() == [0, 1, 2]
    assert np.isnan(stream.device_s).all()


def test_a_thermometer_that_fails_says_so_in_our_words(line):
    instrument, port = line
    device = thermometer(port)
    with pytest.raises(DeviceLost, match="not connected"):
        device.read(0.1)
    device.connect()
    with pytest.raises(DeviceStale, match="no line"):
        device.read(0.05)
    os.write(instrument, b"# firmware 1.2\n")
    with pytest.raises(WireError, match="no temperature"):
        device.read(1.0)
    os.write(instrument, b"\x00" * 40)
    with pytest.raises(WireError, match="baud rate"):
        device.read(1.0)
    device.close()
    device.close()


def test_a_laboratory_s_table_is_identified(tmp_path):
    """An arm 0.4 mm longer than its drawing, seen by a tracker that stands anywhere."""
    rng = np.random.default_rng(4)
    q_deg = rng.uniform(-110.0, 110.0, (120, 6))
    table = [(0.0, 90.0, 89.2), (-425.4, 0.0, 0.0), (-392.0, 0.0, 0.0), (0.0, 90.0, 109.3), (0.0, -90.0, 94.75)]
    point = np.tile([0.3, 50.2, 59.9], (len(q_deg), 1))
    for j, (a_mm, alpha_deg, d_mm) in reversed(list(enumerate([*table, (0.0, 0.0, 82.5)]))):
        point = Rotation.from_euler("x", alpha_deg, degrees=True).apply(point) + np.array([a_mm, 0.0, d_mm])
        point = Rotation.from_euler("z", q_deg[:, j : j + 1], degrees=True).apply(point)
    seen_mm = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1000.0, 2000.0, 500.0])
    seen_mm += rng.normal(0.0, 0.02, seen_mm.shape)
    lab, folder = tmp_path / "lab.xlsx", tmp_path / "session"
    book = openpyxl.Workbook()
    headings = [*(f"A{joint} [deg]" for joint in range(1, 7)), "X/mm", "Y/mm", "Z/mm"]
    for row in (headings, *np.hstack([q_deg, seen_mm]).tolist()):
        book.active.append(row)
    book.save(lab)
    assert run(["import", str(lab), "--rig", str(EXAMPLES / "lab" / "rig.toml"), "--out", str(folder), "--yes"]) == 0
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 0
    model = read_model(tmp_path / "model.json")
    length = next(p for p in model.parameters if p.name == "link2.length")
    assert length.value == pytest.approx(-4e-4, abs=4.0 * length.sigma)
    assert length.sigma < 2e-5
