"""What viewers show of a recording without set-up: its thinned topics, and which curves stand together."""

from dataclasses import dataclass
from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.records import Channel, Schema

from acquisition.recording import RecordingError
from acquisition.recording.mcap import EVENTS_TOPIC, GAPS_TOPIC, SAMPLES_TOPIC, VIEW_TOPIC, Scan, parts

TIME = "host_s"  # of every message: an axis, not a curve
OTHERS = (EVENTS_TOPIC, SAMPLES_TOPIC, GAPS_TOPIC)


@dataclass(frozen=True)
class Views:
    """Topic -> fields, in the order of the file; of views without their time."""

    views: dict[str, tuple[str, ...]]  # by topic, "view/spots"
    others: dict[str, tuple[str, ...]]  # events, samples, gaps, where the recording has them

    def like(self, stream: str, start: str) -> tuple[tuple[str, str], ...]:
        """(topic, field) of the fields of a stream's view that begin so."""
        topic = VIEW_TOPIC + stream
        return tuple((topic, field) for field in self.views.get(topic, ()) if field.startswith(start))


def views_of(path: Path) -> Views:
    """Of a recording, whole or torn, or the first of a session's folder.

    RecordingError where it is none, or shows nothing to viewers.
    """
    if path.is_dir():
        recorded = parts(path)
        if not recorded:
            raise RecordingError(f"{path}: no recording in it, and tables have no topics; give a recording (.mcap)")
        path = recorded[0]
    schemas: dict[int, Schema] = {}
    views: dict[str, tuple[str, ...]] = {}
    others: dict[str, tuple[str, ...]] = {}
    for record in Scan(path).records():
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.schema_id in schemas:
            fields = _fields(schemas[record.schema_id])
            if record.topic.startswith(VIEW_TOPIC):
                views[record.topic] = tuple(name for name in fields if name != TIME)
            elif record.topic in OTHERS:
                others[record.topic] = fields
    if not views:
        raise RecordingError(
            f"{path}: no topic '{VIEW_TOPIC}…' in it, so a viewer has nothing to draw without set-up; recordings of "
            "`calibeam session` and `demo` have some, imported session folders have none"
        )
    return Views(views, others)


def _fields(schema: Schema) -> tuple[str, ...]:
    """Names of the message's fields; none where the description is damaged."""
    try:
        files = FileDescriptorSet.FromString(schema.data).file
    except DecodeError:
        return ()
    kinds = {f"{file.package}.{kind.name}": kind for file in files for kind in file.message_type}
    return tuple(field.name for field in kinds[schema.name].field) if schema.name in kinds else ()


Curve = tuple[str, str]  # topic, field


@dataclass(frozen=True)
class Panel:
    """Curves of one unit in one picture."""

    name: str
    curves: tuple[Curve, ...]


# Name, stream, how its fields begin: streams of docs/formats.md as sessions write them.
WANTED = (
    ("PSD 1, spot (m)", "spots", "psd1_"),
    ("PSD 2, spot (m)", "spots", "psd2_"),
    ("Joint angles (rad)", "robot", "actual_q_rad"),
    ("Joint speeds (rad/s)", "robot", "actual_qd_rad_s"),
    ("Encoders (rad)", "encoders", "position_rad"),
    ("Detector temperature (degC)", "psd", "temperature_degC"),
    ("Detector flags", "psd", "flags"),
)


def panels(views: Views) -> tuple[Panel, ...]:
    """Those that the recording can fill, and what else it shows, a panel a topic."""
    found = [Panel(name, views.like(stream, start)) for name, stream, start in WANTED]
    drawn = {curve for panel in found for curve in panel.curves}
    rest = [
        Panel(topic, tuple((topic, field) for field in fields if (topic, field) not in drawn))
        for topic, fields in views.views.items()
    ]
    return tuple(panel for panel in (*found, *rest) if panel.curves)
