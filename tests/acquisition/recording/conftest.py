"""A small rig, a clock that stands still, and writers over them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.rig import Rig, parse_rig

ROOT = Path(__file__).parents[3]

RIG = """\
schema = 1
name = "two-joint"   # "quoted # not a comment"

[arm]
model = "dh"
gravity_m_s2 = [0, 0, -9.81]

[[arm.joint]]
a_m = 0.3
alpha_rad = 0.0
d_m = 0.1
lower_rad = -3.0
upper_rad = 3.0

[[arm.joint]]
a_m = 0.2
alpha_rad = 1.5
d_m = 0.0
theta_offset_rad = 0.1
lower_rad = -2.0
upper_rad = 2.0

[tool]
laser_origin_m = [0.0, 0.03, 0.05]
laser_direction = [0.0, 2.0, 0.0]

[fixture]
half_size_m = 0.010
psd2_in_psd1 = { origin_m = [0, 0.12, 0.12], rotation_rad = [2.356, 0, 0] }

[[placement]]
id = 1
psd1_in_base = { origin_m = [0.45, 0, 0.20], rotation_rad = [0, 0, 0] }

[[placement]]
id = 7
psd1_in_base = { origin_m = [0.45, 0, 0.40], rotation_rad = [0, 0, 0] }

[[known_distance]]
from = 1
to = 7
length_m = 0.2
sigma_m = 20e-6

[[bar]]
id = 3
length_m = 0.600012

[noise]
psd_m = 2e-6

[devices.psd]
driver = "psd-daq"
port = "tty"

[devices.encoders]
driver = "cia406"
interface = "virtual"
channel = "bus"
nodes = [1, 2]

[emulation]
seed = 4
"""


class StandingClock:
    """Host time that never passes."""

    def now_s(self) -> float:
        return 1000.0


@pytest.fixture
def root() -> Path:
    return ROOT


@pytest.fixture
def rig_source() -> str:
    return RIG


@pytest.fixture(scope="session")
def rig() -> Rig:
    return parse_rig(RIG, "rig.toml")


@pytest.fixture
def open_writer(tmp_path: Path) -> Callable[..., RecordingWriter]:
    """Makes a writer on session.mcap, or on the path given."""

    def make(path: Path | None = None, **options: object) -> RecordingWriter:
        settings: dict[str, object] = {
            "rig_text": RIG,
            "software": "calibeam 0.1.0",
            "clock": StandingClock(),
        } | options
        return RecordingWriter(path or tmp_path / "session.mcap", **settings)  # type: ignore[arg-type]

    return make
