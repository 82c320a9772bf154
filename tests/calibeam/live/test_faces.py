"""One spot of a block is what sessions would make of it, error map included."""

import numpy as np
import pytest

from acquisition.wires.psd_view import PsdView, psd_window
from calibeam.live.messages import faces_now, measured_m
from drivers.device import Block
from drivers.psd_daq.messages import Flag
from drivers.psd_error_map import ErrorMap
from drivers.psd_faces import Face, FaceKind

ZERO = (0.0,) * 5
BENT = ErrorMap(0.01, (3e-5, 0.01, 1e-4, 5e-5, 4e-5), (-2e-5, 0.01, 0.0, 6e-5, 1e-5), ZERO, ZERO, reach=0.6)
FACES = (Face(FaceKind.DUO_LATERAL, 0.02), Face(FaceKind.PIN_CUSHION, 0.02))


def block(*current_a: float, flags: int = 0, count: int = 7) -> Block:
    """A still spot on both faces."""
    number = np.arange(count)
    values = {"photocurrent_a": np.tile(current_a * 2, (count, 1)) * 1e-6, "flags": np.full(count, flags)}
    return Block(number / 1e3, number / 1e3, number, values)


@pytest.mark.parametrize("maps", [(None, None), (BENT, BENT)], ids=["plain", "mapped"])
def test_spots_are_those_of_a_session(maps: tuple[ErrorMap | None, ErrorMap | None]) -> None:
    view, seen = PsdView(FACES, 1e5, maps), block(9.0, 12.0, 11.0, 10.0)
    shown = faces_now(view, seen)
    assert measured_m(shown) == pytest.approx(view.each(psd_window([seen]))[0], abs=1e-9)
    assert [face.sum_v for face in shown] == pytest.approx([2.1, 4.2])
    assert [face.state for face in shown] == ["light", "light"]


def test_light_beyond_the_error_map_is_light_without_a_spot() -> None:
    one, other = faces_now(PsdView(FACES, 1e5, (BENT, None)), block(2.0, 18.0, 10.0, 10.0))
    assert (one.state, one.x_m) == ("no spot", None)
    assert other.state == "light"
    assert measured_m((one, other)) is None


def test_dark_and_too_bright_faces_are_distinguished() -> None:
    flags = Flag.PSD1_NO_LIGHT | Flag.PSD2_SATURATED
    one, other = faces_now(PsdView(FACES, 1e5), block(9.0, 12.0, 11.0, 10.0, flags=flags))
    assert (one.state, one.x_m) == ("no light", None)
    assert other.state == "saturated"
