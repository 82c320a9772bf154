"""What goes to a page, as JSON: once what the rig is, a few times a second how things stand, 30 times what is now.

Ages instead of times of day: a phone's clock is not this machine's.
"""

from typing import Literal

from msgspec import Struct

from calibeam.live.faces import FaceNow
from calibeam.live.feed import Progress
from calibeam.live.health import Health
from calibeam.live.scene import Beam, Points, Standing

Job = Literal["session", "watch"]
Picture = Literal["now", "state"]  # what is made anew at every beat, or at some


class RigSays(Struct, frozen=True, tag_field="kind", tag="rig"):
    """What does not change."""

    name: str
    job: Job
    software: str
    lower_rad: list[float]
    upper_rad: list[float]
    devices: list[str]
    half_m: float | None  # of a face as drawn in the rig
    reach_m: float


class LineSays(Struct, frozen=True):
    """One line of the log."""

    number: int
    age_s: float
    text: str


class StopSays(Struct, frozen=True):
    """`ready`: there is an arm that STOP stops; the rest tells of the last one pressed."""

    ready: bool
    age_s: float | None = None
    delivered: bool | None = None
    who: str = ""
    says: str = ""


class State(Struct, frozen=True, tag_field="kind", tag="state"):
    """How things stand."""

    devices: list[Health]
    progress: Progress | None
    lines: list[LineSays]
    stop: StopSays
    standing: Standing | None


class Trouble(Struct, frozen=True, tag_field="kind", tag="trouble"):
    """Why the page cannot be shown what it should; over with the next message of the kind `of`."""

    of: Picture
    says: str


class Now(Struct, frozen=True, tag_field="kind", tag="now"):
    """The newest of everything; None for what has no fresh sample: it is not shown as live."""

    number: int
    faces: tuple[FaceNow, FaceNow] | None
    q_rad: list[float | None] | None  # None: this joint does not answer
    by: str  # the device that told the joints
    points_m: Points | None  # origins of the base and of every link's frame
    beam: Beam | None
