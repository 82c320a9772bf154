"""An exciting motion in a terminal of its own, ended from outside: the arm stands, the recording is readable."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from acquisition.recording.motion_plan import JointSeries, MotionPlan, write_motion_plan
from acquisition.recording.rig import load_rig
from benchmarks.stops import EVENTS, GO_CUE, MOVES_RAD_S, Staged, staged

from .conftest import RIG_FILE

TIME_SCALE = 2.0
MOVING_RAD_S = 0.1
BRAKES_S, QUIET_S = 1.0, 4.0  # emulated: until it stands, and then
RECORDED_ROWS = 100


@contextmanager
def moving(tmp_path: Path) -> Generator[Staged]:
    """A session whose arm is on its way along the motion."""
    rig, path = load_rig(RIG_FILE), tmp_path / "motion.toml"
    series = (JointSeries(q, (0.0, 0.0), (0.15, -0.0375)) for q in np.array(rig.motion.home_rad).tolist())
    write_motion_plan(path, MotionPlan(1, rig.name, 10.0, 3, tuple(series)))
    with staged(RIG_FILE, ("--motion", str(path)), TIME_SCALE) as s:
        assert s.until(lambda: GO_CUE in s.screen), s.screen
        s.type("go\n")
        assert s.until(lambda: s.watch.newest()[1] > MOVING_RAD_S), s.log
        begin_s = s.now_s()
        assert s.until(lambda: s.watch.newest()[0] > begin_s + 1.0)  # some of it is on the disk
        yield s


def stands(s: Staged) -> bool:
    """Once an arm that brakes now has come to rest."""
    begin_s = s.now_s() + BRAKES_S
    assert s.until(lambda: s.watch.newest()[0] > begin_s + QUIET_S, ended=True)
    return bool((s.watch.since(begin_s)[1] < MOVES_RAD_S).all())


def ended(s: Staged) -> int:
    s.until(lambda: s.process.poll() is not None, 30.0)
    return s.process.wait(30.0)


def rows_kept(s: Staged) -> int:
    kept = read(s.folder / "out" / "recording.mcap")
    assert not kept.complete
    return len(kept.streams["robot"].host_s)


def test_ctrl_c_brakes_on_the_way_and_a_gives_up(tmp_path: Path) -> None:
    with moving(tmp_path) as s:
        s.type("\x03")
        assert s.until(lambda: "r resume" in s.screen), s.screen
        assert stands(s)
        assert s.process.poll() is None
        s.type("a\n")
        assert ended(s) == 3
        assert "Traceback" not in s.screen
        assert rows_kept(s) > RECORDED_ROWS


@pytest.mark.endure
@pytest.mark.parametrize(
    "event",
    ["SIGTERM", "controller silent", "protective stop", "disk full", "control child killed", "Ctrl-C ten times"],
)
def test_whatever_ends_it_the_arm_stands_and_the_recording_is_readable(event: str, tmp_path: Path) -> None:
    with moving(tmp_path) as s:
        EVENTS[event](s)
        silent = event == "controller silent"  # nobody sees whether its arm stands, until it speaks again
        assert ended(s) == 3, s.screen
        if silent:
            s.emulation.ask("robot.silence", on=False)
        assert stands(s)
        assert "Traceback" not in s.screen
        assert rows_kept(s) > RECORDED_ROWS
