"""`compare`: two recordings of one motion, where they part first, and what the simulation lacks."""

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.session_folder import write_csv
from benchmarks.stream_cases import servo_scene
from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
NOISE_M = 2e-6
SHIFT_M = 2e-4


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    """Of one motion: measured with a disc off centre, and simulated without, each with noise of its own."""
    folder = tmp_path_factory.mktemp("sessions")
    for name, defects in (("measured", ("encoder-eccentricity",)), ("simulated", ())):
        case = conceal(Wanted("dual-psd", seed=7, defects=defects, enr=1.0, samples=120, places=3))
        write_case(case, folder / name)
    return folder / "measured" / "recording", folder / "simulated" / "recording"


def rewritten(source, folder, change):
    """The same session with other samples."""
    recording = read(source)
    folder.mkdir()
    (folder / "rig.toml").write_text(recording.rig_text, encoding="utf-8")
    samples = recording.samples
    columns = {name: np.array(values) for name, values in samples.columns.items()}
    write_csv(replace(samples, columns=change(columns)), folder / "samples.csv")
    return folder


def noisy(columns):
    rng = np.random.default_rng(3)
    for name in ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m"):
        columns[name] += rng.normal(0.0, NOISE_M, len(columns[name]))
    return columns


def compared(measured, simulated, tmp_path, *options):
    out = tmp_path / "compare.json"
    assert run(["compare", str(measured), str(simulated), "--out", str(out), *options]) == 0
    return json.loads(out.read_bytes())


def test_what_the_simulation_lacks_is_named(sessions, tmp_path):
    measured, simulated = sessions
    said = compared(measured, rewritten(simulated, tmp_path / "noisy", noisy), tmp_path)
    truth = msgspec.json.decode((measured.parent / "sealed" / "truth.json").read_bytes())["defects"][0]
    assert said["first_link"] == "spots"
    (finding,) = said["diagnosis"]["findings"]
    assert finding["physics"] == "encoder-eccentricity"
    assert finding["where"] == truth["port"]
    amplitude = finding["parameters"]["amplitude_rad"]
    assert abs(amplitude["value"] - truth["figures"]["amplitude_rad"]) < 4.0 * amplitude["sigma"]


@pytest.mark.endure  # daily: test_what_the_simulation_lacks_is_named
def test_a_detector_that_sits_at_another_place_next_to_the_other_is_named(sessions, tmp_path):
    def shifted(columns):
        columns["psd2_x_m"] -= SHIFT_M  # in its own plane: the beam meets it where it did
        return noisy(columns)

    said = compared(rewritten(sessions[1], tmp_path / "shifted", shifted), sessions[1], tmp_path)
    (one,) = (d for d in said["differences"] if d["decides"])
    assert (one["where"], one["physics"]) == ("psd2.reading", "psd-moved")
    shift = one["sizes"]["x_m"]
    assert abs(shift["value"] - SHIFT_M) < 4.0 * shift["sigma"] < SHIFT_M / 3.0


def test_sessions_that_differ_by_noise_agree(sessions, tmp_path):
    said = compared(sessions[1], rewritten(sessions[1], tmp_path / "noisy", noisy), tmp_path, "--exit-code")
    assert said["first_link"] is None
    assert said["verdict"] == "consistent"
    assert said["differences"] == []


def test_joints_that_read_otherwise_where_the_spots_are_the_same_part_at_the_spots(sessions, tmp_path):
    def shifted(columns):
        columns["q3_rad"] = columns["q3_rad"] + 1e-3
        return columns

    other = rewritten(sessions[1], tmp_path / "shifted", shifted)
    said = compared(other, sessions[1], tmp_path, "--no-diagnose")
    links = {link["link"]: link for link in said["links"]}
    assert said["first_link"] == "spots"
    assert said["verdict"] == "mismatch"
    assert links["joints"]["mean_own"][2] == pytest.approx(1e-3)
    assert said["diagnosis"] is None


def test_rows_without_a_partner_are_reported(sessions, tmp_path):
    fewer = rewritten(sessions[1], tmp_path / "fewer", lambda columns: {n: v[5:] for n, v in columns.items()})
    said = compared(sessions[1], fewer, tmp_path, "--no-diagnose")
    assert len(said["only_measured_t_s"]) == 5
    assert said["only_simulated_t_s"] == []
    assert said["first_link"] is None


def test_other_motions_are_refused(sessions, tmp_path, capsys):
    write_case(conceal(Wanted("dual-psd", seed=8, defects=(), enr=1.0, samples=120, places=3)), tmp_path / "away")
    other = str(tmp_path / "away" / "recording")
    assert run(["compare", str(sessions[1]), other, "--out", str(tmp_path / "c.json")]) == 1
    assert "same motion" in capsys.readouterr().err


class Standing:
    """Host time that never passes."""

    def now_s(self) -> float:
        return 0.0


def recorded(path, scene, late_s=0.0):
    """A recording with streams of controller and encoders; these come late, and joint 4 of them slips."""
    joints, encoders = scene.joints(), scene.encoders()
    with RecordingWriter(path, rig_text=RIG.read_text(encoding="utf-8"), software="t", clock=Standing()) as writer:
        for track, channel, shift in ((joints, "actual_q_rad", 0.0), (encoders, "position_rad", late_s)):
            stream = writer.stream(track.name, (Channel(channel, "rad", (6,)),))
            t = track.time_s + shift
            stream.append(t, t, np.arange(len(t)), {channel: track.values})
        for k, (begin_s, _) in enumerate(scene.motion.stands):
            q = scene.true(np.array([begin_s + 0.3]))[0]
            row = {f"q{i + 1}_rad": float(v) for i, v in enumerate(q)}
            writer.sample({"t_s": float(k), **row})
    return path


def test_streams_tell_which_device_is_late(tmp_path):
    scene = servo_scene(1)
    measured = recorded(tmp_path / "measured.mcap", scene, late_s=3e-3)
    simulated = recorded(tmp_path / "simulated.mcap", servo_scene(1))
    said = compared(measured, simulated, tmp_path)
    streams = {one["stream"]: one for one in said["streams"]}
    assert streams["joints"]["offset_s"] == pytest.approx(0.0, abs=1e-4)
    assert streams["encoders"]["later_than_joints_s"] == pytest.approx(3e-3, abs=1e-4)


def test_a_file_in_millimetres_is_named_before_anything_is_compared(sessions, tmp_path, capsys):
    spots = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
    wrong = rewritten(
        sessions[1], tmp_path / "millimetres", lambda columns: {**columns, **{n: 1e3 * columns[n] for n in spots}}
    )
    assert run(["compare", str(sessions[1]), str(wrong), "--out", str(tmp_path / "c.json")]) == 1
    said = capsys.readouterr().err
    assert str(wrong) in said
    assert "millimetres" in said
    assert not (tmp_path / "c.json").exists()


def test_a_recording_without_samples_is_one_sentence(sessions, tmp_path, capsys):
    empty = rewritten(sessions[1], tmp_path / "empty", lambda columns: {n: v[:0] for n, v in columns.items()})
    assert run(["compare", str(empty), str(sessions[1]), "--out", str(tmp_path / "c.json")]) == 1
    assert "measured: no sample" in capsys.readouterr().err
