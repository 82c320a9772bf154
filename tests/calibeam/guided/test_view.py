"""What a person at the arm is told."""

import io

import numpy as np
from rich.console import Console

from acquisition.guided.reading import BarEnd, Cone, Coverage, GuidedProgress, Request
from calibeam.guided.run import PersonGuide, drawn

CONE = Cone(2, (0.5, 0.1, 0.0))


def progress(says="moving", repeatability_m=None):
    coverage = Coverage(np.full(2, -np.pi), np.full(2, np.pi))
    coverage.add(np.array([-3.0, 0.1]))
    request = Request(CONE, np.array([0.1, -1.5]), 1)
    return GuidedProgress(3, 40, says, np.array([0.0, 0.5]), request, coverage, repeatability_m)


def shown(what) -> str:
    console = Console(file=io.StringIO(), width=120)
    console.print(what)
    return console.file.getvalue()


def test_the_view_says_what_where_which_way_and_how_much_is_covered():
    text = shown(drawn(progress("still, but 80 mm from cone 2", 4.2e-6)))
    assert "3 of 40 readings; cone 2: still, but 80 mm from cone 2" in text
    assert "repeats to 4.2 µm" in text
    assert "good" in text  # joint 1 is 6 deg from the wanted posture
    assert "←←←" in text  # joint 2 is 115 deg beyond it
    assert "▪···········" in text


def test_without_a_repeated_cone_there_is_no_repeatability():
    assert "repeats" not in shown(drawn(progress()))


def test_a_person_is_asked_once_for_each_place_and_again_after_a_slip():
    console = Console(file=io.StringIO(), width=120)
    guide = PersonGuide(console)
    end = BarEnd(4, 1, "a", (0.0, 0.0, 0.0))
    posture = np.zeros(6)
    for target, attempt in ((CONE, 1), (CONE, 1), (CONE, 2), (end, 1)):
        assert guide.ask(Request(target, posture, attempt))
    guide.tell(progress())
    assert console.file.getvalue().splitlines() == [
        "put the probe on cone 2",
        "put the probe on cone 2 again (2), lift it out first",
        "put the probe on end a of bar 1, position 4",
    ]
