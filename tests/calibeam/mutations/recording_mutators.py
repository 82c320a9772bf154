"""Changes to what a recording holds, with new checksums: metadata, descriptions, messages, their order.

Written again by the MCAP library itself, so that nothing but the change is wrong; a change of bytes fails a checksum.
"""

import hashlib
import io
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from mcap.reader import NonSeekingReader
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from tests.calibeam.mutations.json_mutators import JSON
from tests.calibeam.mutations.text_mutators import BINARY, NUMBERS, TEXTS, TOML, Mutator, Rng, pick
from tests.mutated import mutated


@dataclass
class _Content:
    """Records of a whole recording in their order."""

    metadata: list[Metadata]
    messages: list[tuple[Schema | None, Channel, Message]]


def rewritten(data: bytes, change: Callable[[bytes], bytes]) -> bytes:
    """The same recording with every message changed."""
    content = content_of(data)
    content.messages = [(s, c, replace(m, data=change(m.data))) for s, c, m in content.messages]
    return _written(content)


def content_of(data: bytes) -> _Content:
    records = StreamReader(io.BytesIO(data)).records
    return _Content(
        [one for one in records if isinstance(one, Metadata)],
        list(NonSeekingReader(io.BytesIO(data)).iter_messages(log_time_order=False)),
    )


def _rewritten(change: Callable[[Rng, _Content], None]) -> Mutator:
    def made(rng: Rng, data: bytes) -> bytes:
        content = content_of(data)
        change(rng, content)
        return _written(content)

    made.__name__ = change.__name__
    return made


def _written(content: _Content) -> bytes:
    out, schemas, channels = io.BytesIO(), dict[int, int](), dict[tuple[int, str], int]()
    writer = Writer(out)
    writer.start(profile="calibeam", library="test")
    for one in content.metadata:
        writer.add_metadata(one.name, one.metadata)
    for schema, channel, message in content.messages:
        if schema is not None and schema.id not in schemas:
            schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
        key = (channel.id, channel.topic)
        if key not in channels:
            known = 0 if schema is None else schemas[schema.id]
            channels[key] = writer.register_channel(channel.topic, channel.message_encoding, known, channel.metadata)
        writer.add_message(channels[key], message.log_time, message.data, message.publish_time, message.sequence)
    writer.finish()
    return out.getvalue()


@_rewritten
def metadata_changed(rng: Rng, content: _Content) -> None:
    """One value, without the checksum, which recordings of earlier versions do not have."""
    at = pick(rng, [k for k, one in enumerate(content.metadata) if one.metadata.keys() - {"crc32"}])
    one = content.metadata[at]
    held = {key: value for key, value in one.metadata.items() if key != "crc32"}
    key = pick(rng, sorted(held))
    if rng.random() < 0.2:
        del held[key]
    else:
        held[key] = _changed_text(rng, held[key])
    if "sha256" in held and "text" in held:
        held["sha256"] = hashlib.sha256(held["text"].encode("utf-8", "replace")).hexdigest()
    content.metadata[at] = Metadata(one.name, held)


def _changed_text(rng: Rng, text: str) -> str:
    kinds = TOML if text.startswith(("#", "schema")) else JSON if text[:1] in "[{" and len(text) > 2 else ()
    if kinds and rng.random() < 0.8:
        return pick(rng, kinds)(rng, text.encode()).decode("utf-8", "replace")
    return pick(rng, (*NUMBERS, *TEXTS))


@_rewritten
def metadata_lost(rng: Rng, content: _Content) -> None:
    del content.metadata[int(rng.integers(len(content.metadata)))]


@_rewritten
def channel_changed(rng: Rng, content: _Content) -> None:
    """The topic, or what the channel says of its fields, of all its messages."""
    chosen = pick(rng, content.messages)[1]
    held = {key: _changed_text(rng, value) if rng.random() < 0.7 else value for key, value in chosen.metadata.items()}
    topic = pick(rng, (chosen.topic, "samples", "events", "gaps", "stream/", "stream/" + "x" * 300, "view/spots"))
    other = replace(chosen, metadata=held, topic=topic)
    content.messages = [(s, other if c.id == chosen.id else c, m) for s, c, m in content.messages]


@_rewritten
def schema_changed(rng: Rng, content: _Content) -> None:
    chosen = pick(rng, content.messages)[0]
    if chosen is None:
        return
    other = replace(chosen, data=pick(rng, (b"", mutated(rng, [chosen.data], pieces=1))))
    content.messages = [(other if s is not None and s.id == chosen.id else s, c, m) for s, c, m in content.messages]


@_rewritten
def message_changed(rng: Rng, content: _Content) -> None:
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(content.messages)))
        schema, channel, message = content.messages[at]
        changed: dict[str, Any] = {"data": mutated(rng, [message.data], pieces=1)}
        content.messages[at] = (schema, channel, replace(message, **changed))


@_rewritten
def messages_mixed(rng: Rng, content: _Content) -> None:
    order = rng.permutation(len(content.messages))
    content.messages = [content.messages[k] for k in order[: int(rng.integers(len(order) + 1))]]


RECORDING: tuple[Mutator, ...] = (
    *BINARY, metadata_changed, metadata_changed, metadata_changed, metadata_lost, channel_changed, schema_changed,
    message_changed, message_changed, messages_mixed,
)  # fmt: skip
