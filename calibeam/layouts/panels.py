"""Which curves stand together, whatever the viewer: the faces, spots, joints, motion, health."""

from dataclasses import dataclass

from calibeam.layouts.views import Views

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
