"""Every topic and field that the layouts name stands in the recording, read by somebody else's decoder."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from acquisition.recording import Channel, Event, RecordingWriter
from acquisition.recording.rig import rig_text
from acquisition.recording.samples import SPOTS
from calibeam.cli import run
from calibeam.commands.demo import RIG
from calibeam.devices.site import VIEWED
from drivers.clock import SystemClock
from drivers.ur.reader import VARIABLES

SIX = (6,)


@pytest.fixture
def recording(tmp_path):
    """The streams that a session writes, some samples each."""
    path = tmp_path / "r.mcap"
    robot = tuple(
        Channel(v.channel.name, v.channel.unit, v.channel.shape) for v in VARIABLES if v.channel.shape in ((), SIX)
    )
    streams = {
        "spots": (tuple(Channel(name, "m") for name in SPOTS), None),
        "psd": (
            (Channel("photocurrent_a", "A", (8,)), Channel("flags", ""), Channel("temperature_degC", "degC")),
            None,
        ),
        "robot": (robot, None),
        "encoders": ((Channel("position_rad", "rad", SIX), Channel("emergency_code", "", SIX)), None),
    }
    with RecordingWriter(path, rig_text=rig_text(RIG), software="calibeam", clock=SystemClock()) as writer:
        for name, (channels, _) in streams.items():
            viewed = tuple(c.name for c in channels if c.name in VIEWED.get(name, tuple(c.name for c in channels)))
            stream = writer.stream(name, channels, viewed)
            t = np.arange(3) * 0.1
            stream.append(t, t, np.arange(3), {c.name: np.zeros((3, *c.shape)) for c in channels})
        writer.event(Event(0.0, "end", {}))
    return path


@pytest.fixture
def fields(recording):
    """(topic, field) of every message."""
    with recording.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return {
            (channel.topic, field.name)
            for _, channel, _, message in reader.iter_decoded_messages()
            for field in message.DESCRIPTOR.fields
        }


def test_every_path_of_the_foxglove_layout_is_in_the_recording(recording, fields, tmp_path):
    assert run(["layouts", str(recording), "--out", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "foxglove.json").read_text()
    layout = json.loads(text)
    paths = set(re.findall(r'"value": "([^"]+)"', text))
    assert {tuple(path.split(".")) for path in paths} <= fields
    assert {"view/spots.psd1_x_m", "view/robot.actual_q_rad_6", "view/encoders.position_rad_1"} <= paths
    assert layout["configById"]["RawMessages!events"]["topicPath"] in {topic for topic, _ in fields}


def test_every_panel_of_the_foxglove_layout_has_its_place(recording, tmp_path):
    run(["layouts", str(recording), "--out", str(tmp_path / "out")])
    layout = json.loads((tmp_path / "out" / "foxglove.json").read_text())

    def leaves(tree):
        return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])

    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])


def test_every_curve_of_the_plotjuggler_layout_is_in_the_recording(recording, fields, tmp_path):
    run(["layouts", str(recording), "--out", str(tmp_path / "out")])
    root = ElementTree.parse(tmp_path / "out" / "plotjuggler.xml").getroot()
    curves = {curve.get("name", "") for curve in root.iter("curve")}
    assert {tuple(curve.rsplit("/", 1)) for curve in curves} <= fields
    assert {"view/spots/psd2_y_m", "view/robot/actual_q_rad_1"} <= curves
    topics = root.find("Plugins/plugin/parameters").get("selected_topics").split(";")
    assert {curve.rsplit("/", 1)[0] for curve in curves} == set(topics)
    for splitter in root.iter("DockSplitter"):
        assert int(splitter.get("count")) == len(splitter.findall("DockArea")) == len(splitter.get("sizes").split(";"))


def test_the_folder_of_a_session_is_its_first_recording(recording, tmp_path):
    (tmp_path / "session").mkdir()
    recording.rename(tmp_path / "session" / "recording.mcap")
    assert run(["layouts", str(tmp_path / "session"), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "foxglove.json").exists()


def test_a_folder_without_a_recording_has_nothing_to_show(tmp_path, capsys):
    assert run(["layouts", str(tmp_path), "--out", str(tmp_path / "out")]) == 1
    assert "give a recording" in capsys.readouterr().err
