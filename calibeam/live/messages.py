"""What goes to a page, as JSON: once the rig, a few times a second the state, 30 times a second the picture.

Ages instead of times of day: a phone's clock is not this machine's. A face is described by where the light is, how
much of it there is, and what is wrong with it.
"""

from math import isfinite
from typing import Literal

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.wires.psd_view import NO_LIGHT, SATURATED, PsdView
from calibeam.live.feed import Progress
from calibeam.live.health import Health
from calibeam.live.scene import Points, SceneBeam, SceneFixture
from drivers.device import Block

NEWEST = 50  # samples at 1 kHz: longer than a look at 30 Hz, so that a mean sees them all


class FaceNow(Struct, frozen=True):
    """One face. `state`: "light", "saturated", "no light", or "no spot": light, but beyond the error map, or where no
    spot explains the currents. Positions (m) are None where there is none.
    """

    state: str
    x_m: float | None
    y_m: float | None
    sum_v: float
    half_m: float


def faces_now(view: PsdView, block: Block) -> tuple[FaceNow, FaceNow]:
    """Both faces by the newest samples: one spot of their averaged currents, as sessions average them."""
    current_a = block.values["photocurrent_a"][-NEWEST:].mean(axis=0)
    flags = block.values["flags"][-NEWEST:].astype(np.int64)
    newest, ever = int(flags[-1]), int(np.bitwise_or.reduce(flags))
    return _face(view, 0, current_a[:4], newest, ever), _face(view, 1, current_a[4:], newest, ever)


def _face(view: PsdView, k: int, current_a: NDArray[np.float64], newest: int, ever: int) -> FaceNow:
    """One spot; PsdView.each says the same of many samples, and would take twice the time of one."""
    face, error_map = view.faces[k], view.maps[k]
    reading = face.read(current_a)
    sum_v, half_m = round(float(reading.sum_a) * view.transimpedance_v_a, 4), 0.5 * face.length_m
    corrected = (reading.x_m, reading.y_m) if error_map is None else error_map.correct(reading.x_m, reading.y_m)
    x_m, y_m = (float(value) for value in corrected)
    if newest & NO_LIGHT[k]:
        return FaceNow("no light", None, None, sum_v, half_m)
    if not (isfinite(x_m) and isfinite(y_m)):
        return FaceNow("no spot", None, None, sum_v, half_m)
    return FaceNow("saturated" if ever & SATURATED[k] else "light", round(x_m, 9), round(y_m, 9), sum_v, half_m)


def measured_m(faces: tuple[FaceNow, FaceNow] | None) -> list[float] | None:
    """psd1 x, y, psd2 x, y (4,) where both are lit."""
    found = [value for face in faces or () for value in (face.x_m, face.y_m) if value is not None]
    return found if len(found) == 4 else None


Job = Literal["session", "watch"]
Picture = Literal["now", "state"]  # what is made again at every beat, or at some


class RigMessage(Struct, frozen=True, tag_field="kind", tag="rig"):
    """What does not change."""

    name: str
    job: Job
    software: str
    lower_rad: list[float]
    upper_rad: list[float]
    devices: list[str]
    half_m: float | None  # of a face as drawn in the rig
    reach_m: float


class LineMessage(Struct, frozen=True):
    """One line of the log."""

    number: int
    age_s: float
    text: str


class StopMessage(Struct, frozen=True):
    """`ready`: there is an arm that STOP stops; the rest tells of the last one pressed."""

    ready: bool
    age_s: float | None = None
    delivered: bool | None = None
    who: str = ""
    says: str = ""


class StateMessage(Struct, frozen=True, tag_field="kind", tag="state"):
    """How things stand."""

    devices: list[Health]
    progress: Progress | None
    lines: list[LineMessage]
    stop: StopMessage
    standing: SceneFixture | None


class TroubleMessage(Struct, frozen=True, tag_field="kind", tag="trouble"):
    """Why the page cannot be shown what it should; over with the next message of the kind `of`."""

    of: Picture
    says: str


class PictureMessage(Struct, frozen=True, tag_field="kind", tag="now"):
    """The newest of everything; None for what has no fresh sample: it is not shown as live."""

    number: int
    faces: tuple[FaceNow, FaceNow] | None
    q_rad: list[float | None] | None  # None: this joint does not answer
    by: str  # the device that told the joints
    points_m: Points | None  # origins of the base and of every link's frame
    beam: SceneBeam | None
