"""The file opened by independent readers, mcap with protobuf and mcap's own decoder; nothing of ours after writing."""

import json
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event

Open = Callable[..., RecordingWriter]


@pytest.fixture
def recorded(open_writer: Open) -> Path:
    """Two seconds of a detector at 1 kHz, a sample, an event."""
    channels = (Channel("spot_x_m", "m", (), 0.01, 1e-7), Channel("q_rad", "rad", (2,)), Channel("flags", ""))
    number = np.arange(2000)
    time_s = 1000.0 + number * 1e-3
    with open_writer(notes={"seed": "3"}) as writer:
        stream = writer.stream("psd", channels, viewer=("spot_x_m", "q_rad"))
        joints = np.stack([number, -number], axis=1) * 0.5
        stream.append(time_s, time_s, number, {"spot_x_m": number * 1e-6, "q_rad": joints, "flags": number})
        writer.sample({"t_s": 1.5, "q1_rad": 0.25, "q2_rad": 0.0, "repeat": None, "my column": 4.0})
        writer.event(Event(1001.0, "servo", {"step": 1}))
    return writer.path


def messages(path: Path, topic: str) -> Iterator[tuple[Any, Any, Any]]:
    """Channel, message record and decoded message of one topic."""
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(topics=[topic]):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            pool = descriptor_pool.DescriptorPool()
            for described in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(described)
            kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
            yield channel, message, kind.FromString(message.data)


def test_batches_hold_every_sample_in_packed_fields(recorded: Path) -> None:
    found = list(messages(recorded, "stream/psd"))
    assert [len(batch.host_s) for _, _, batch in found] == [100] * 20
    assert [record.log_time for _, record, _ in found] == [round((1000.0 + 0.1 * at) * 1e9) for at in range(20)]
    flattened = np.concatenate([batch.q_rad for _, _, batch in found]).reshape(-1, 2)
    np.testing.assert_array_equal(flattened[:, 1], -0.5 * np.arange(2000))
    assert [flag for _, _, batch in found for flag in batch.flags] == list(range(2000))
    declared = json.loads(found[0][0].metadata["channels"])
    assert declared[1] == {"name": "q_rad", "unit": "rad", "shape": [2], "resolution": 0.0}
    assert declared[0]["full_scale"] == 0.01


def test_viewers_find_single_samples_at_20_hz(recorded: Path) -> None:
    view = [sample for _, _, sample in messages(recorded, "view/psd")]
    assert 39 <= len(view) <= 41
    assert [field.name for field in view[0].DESCRIPTOR.fields] == ["host_s", "spot_x_m", "q_rad_1", "q_rad_2"]
    assert view[7].q_rad_1 == -view[7].q_rad_2 == pytest.approx(0.5e6 * view[7].spot_x_m)
    steps = np.diff([sample.host_s for sample in view])
    assert steps.min() > 0.0499


def test_a_settled_sample_is_one_message_whose_absent_fields_are_missing_cells(recorded: Path) -> None:
    ((channel, record, sample),) = messages(recorded, "samples")
    assert record.log_time == 1_001_500_000_000
    assert (sample.t_s, sample.q1_rad) == (1.5, 0.25)
    assert not sample.HasField("repeat")
    field = json.loads(channel.metadata["columns"])["my column"]
    assert getattr(sample, field) == 4.0


def test_events_are_readable_without_us(recorded: Path) -> None:
    ((_, record, event),) = messages(recorded, "events")
    assert (record.log_time, event.kind, json.loads(event.detail_json)) == (1_001_000_000_000, "servo", {"step": 1})


def test_the_index_and_the_metadata_are_whole(recorded: Path, rig_source: str) -> None:
    with recorded.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "calibeam"
        summary = reader.get_summary()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == sum(len(list(messages(recorded, topic))) for topic in
                                                   ("stream/psd", "view/psd", "samples", "events"))  # fmt: skip
    assert metadata["calibeam.rig"]["text"] == rig_source
    assert metadata["calibeam.notes"] == {"seed": "3", "crc32": f"{zlib.crc32(b'seed=3' + bytes([10])):08x}"}
    assert metadata["calibeam.recording"]["software"] == "calibeam 0.1.0"
    assert metadata["calibeam.end"]["complete"] == "true"


def test_the_decoder_of_mcap_for_protobuf_reads_every_topic(recorded: Path) -> None:
    with recorded.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = [(channel.topic, message) for _, channel, _, message in reader.iter_decoded_messages()]
    assert {topic for topic, _ in decoded} == {"stream/psd", "view/psd", "samples", "events"}
    numbers = [number for topic, message in decoded if topic == "stream/psd" for number in message.sequence]
    assert numbers == list(range(2000))
