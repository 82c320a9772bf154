"""`calibeam log`: a device recorded for as long as it takes, without a session."""

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import msgspec
from cyclopts import App, Parameter

from acquisition.recording import RecordingError
from acquisition.recording.mcap import Rotation
from acquisition.recording.rig import load_rig, rig_text
from calibeam.console import Console
from calibeam.devices.encoder_log import EncoderLog, LogState
from calibeam.outcome import PartialResult
from calibeam.site_log import logged
from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceError, DeviceRefused

log = App(
    name="log",
    help="Log the encoders, or the tracker, until Ctrl-C.\n\nFor example:\n\n```\ncalibeam log encoders rig.toml\n```",
)

MEGABYTE = 1e6


@dataclass(frozen=True)
class LogOptions:
    """How long a log goes on, and in which segments.

    Parameters
    ----------
    rotate_mb
        Size of a segment from which the next is begun.
    rotate_min
        Age of a segment, in minutes, from which the next is begun.
    for_s
        End by itself after so many seconds.
    json_
        Print one line of JSON at the end, and nothing else.

    """

    rotate_mb: float = 256.0
    rotate_min: float = 60.0
    for_s: float | None = None
    json_: Annotated[bool, Parameter(name="--json")] = False

    @property
    def rotation(self) -> Rotation:
        """DeviceRefused for a size or an age that is none."""
        if not (0.0 < self.rotate_mb < math.inf and 0.0 < self.rotate_min < math.inf):
            raise DeviceRefused(
                f"--rotate-mb {self.rotate_mb:g}, --rotate-min {self.rotate_min:g}: give finite numbers above 0"
            )
        return Rotation(round(self.rotate_mb * MEGABYTE), 60.0 * self.rotate_min)


@log.command
@logged
def encoders(
    rig: Path,
    *,
    out: Path = Path("encoder-log"),
    raw: bool = True,
    options: Annotated[LogOptions, Parameter(name="*")] = LogOptions(),
) -> None:
    """Log the encoders until Ctrl-C: positions and every CAN frame, in segments of which each is a whole recording.

    For example:

    ```
    calibeam log encoders rigs/ur5e-dual-psd.toml --out encoder-log
    ```

    A bus that is lost is attached again, with a gap in the recording. Started again with the same folder, the log goes
    on in a new segment. Whatever ends it, 0.1 s are lost at most.

    Parameters
    ----------
    rig
        The rig file; [devices.encoders] holds how they are reached.
    out
        Folder for segment-0001.mcap and those after it; nothing in it is overwritten.
    raw
        Also every frame on the bus, sent and received, as it was; `calibeam export` makes BLF, ASC, CSV or candump of
        them.
    options
        Of the length of the log and its segments.

    """
    rotation = options.rotation
    loaded = load_rig(rig, needs_arm=False)
    device = loaded.devices.encoders
    if device is None:
        raise DeviceRefused(f"rig {loaded.name}: no [devices.encoders]; add it, with how the encoders are reached")
    _log(EncoderLog(device, rig_text(rig), out, SystemClock(), rotation, raw=raw), out, options)


@log.command
@logged
def tracker(
    rig: Path,
    *,
    out: Path = Path("tracker-log"),
    options: Annotated[LogOptions, Parameter(name="*")] = LogOptions(),
) -> None:
    """Log the tracker until Ctrl-C: every position that it prints, in segments of which each is a whole recording.

    For example:

    ```
    calibeam log tracker rigs/ur5e-tracker.toml --out tracker-log
    ```

    An instrument that is lost is attached again, with a gap in the recording. Started again with the same folder, the
    log goes on in a new segment.

    Parameters
    ----------
    rig
        The rig file; [devices.tracker] states how the instrument is reached and what it prints.
    out
        Folder for segment-0001.mcap and those after it; nothing in it is overwritten.
    options
        Of the length of the log and its segments.

    """
    rotation = options.rotation
    loaded = load_rig(rig, needs_arm=False)
    device = loaded.devices.tracker
    if device is None:
        raise DeviceRefused(f"rig {loaded.name}: no [devices.tracker]; add it, with how the tracker is reached")
    _log(EncoderLog(device, rig_text(rig), out, SystemClock(), rotation, raw=False), out, options)


def _log(job: EncoderLog, out: Path, options: LogOptions) -> None:
    console = Console(quiet=options.json_)
    try:
        with console.status("connecting", refresh_per_second=2.0) as status:
            job.run(partial(_is_over, job, options.for_s, SystemClock()), lambda state: status.update(_now(state)))
    except (DeviceError, RecordingError) as why:
        if job.state.rows == 0:
            raise
        raise PartialResult(f"{why}; rows kept in {out}: {job.state.rows}") from why
    console.print(_summary(job.state, job.segments), highlight=False)
    if options.json_:
        print(msgspec.json.encode(_as_json(job.state, job.segments)).decode())


def _is_over(job: EncoderLog, for_s: float | None, clock: Clock) -> bool:
    """Counted from the moment at which the encoders are set up."""
    return for_s is not None and job.since_s is not None and clock.now_s() >= job.since_s + for_s


def _now(state: LogState) -> str:
    frames = f", frames: {state.frames}" if state.frames else ""
    away = "" if state.away is None else f"; device lost: {state.away}"
    return f"{state.segment.name}: rows: {state.rows}{frames}{away} (Ctrl-C ends the log)"


def _summary(state: LogState, segments: list[Path]) -> str:
    which = segments[0].name if len(segments) == 1 else f"{segments[0].name} to {segments[-1].name}"
    outages = f", outages: {state.outages}" if state.outages else ""
    at_least = "at least " if state.outages else ""
    gaps = "1 gap" if state.gaps == 1 else f"{state.gaps} gaps"
    missing = f"{at_least}{state.missing} missing in {gaps}" if state.gaps else "no gaps"
    frames = f"; frames: {state.frames}" if state.frames else ""
    errors = f", error frames among them: {state.error_frames}" if state.error_frames else ""
    return f"{segments[0].parent}: {which}: rows: {state.rows}, {missing}{frames}{errors}{outages}"


def _as_json(state: LogState, segments: list[Path]) -> dict[str, Any]:
    return {
        "segments": [str(path) for path in segments],
        "rows": state.rows,
        "missing": state.missing,
        "gaps": state.gaps,
        "frames": state.frames,
        "error_frames": state.error_frames,
        "outages": state.outages,
    }
