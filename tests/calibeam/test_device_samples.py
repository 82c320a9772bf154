"""What a second of samples tells of a device."""

import numpy as np
import pytest

from calibeam.devices.encoders import bus_trouble, sample_noise, sample_rate, uneven_layers, unread
from drivers.device import Block
from drivers.psd_daq.messages import FaceIdentity
from drivers.psd_faces import FaceKind

FACES = tuple(FaceIdentity(FaceKind.DUO_LATERAL, 0.02) for _ in range(2))


def block(step: int = 1, **values: np.ndarray) -> Block:
    number = np.arange(0, 100, step)
    return Block(0.01 * number, 0.01 * number, number, values)


def test_the_pace_of_a_stream_and_what_was_lost_on_its_way() -> None:
    assert sample_rate([block()], 100.0) == (pytest.approx(100.0), "")
    rate_hz, wrong = sample_rate([block(step=2)], 100.0)
    assert rate_hz == pytest.approx(50.0)
    assert wrong.startswith("100 Hz are asked for, 49 samples were lost on the way: lower the rate")


def test_noise_is_that_of_the_noisiest_column_whatever_it_moves() -> None:
    rng = np.random.default_rng(1)
    drifting = np.linspace(0.0, 1.0, 4000)[:, None] + rng.normal(0.0, [0.01, 0.03], (4000, 2))
    assert sample_noise(drifting) == pytest.approx(0.03, rel=0.05)


def test_noise_of_a_shaft_that_turns_to_and_fro() -> None:
    time_s, rng = 0.01 * np.arange(4000.0), np.random.default_rng(2)
    turning_rad = 10.0 * np.sin(0.3 * time_s)[:, None] + rng.normal(0.0, 5e-6, (4000, 2))
    assert sample_noise(turning_rad) == pytest.approx(5e-6, rel=0.1)
    turning_rad[1000:1005, 0] = np.nan  # no answer
    assert sample_noise(turning_rad) == pytest.approx(5e-6, rel=0.1)
    turning_rad[:, 1] = np.nan
    assert sample_noise(turning_rad) == pytest.approx(5e-6, rel=0.1)
    assert sample_noise(turning_rad[:2]) == 0.0


@pytest.mark.parametrize(("share", "wrong"), [(1.0, ""), (0.99, ""), (0.9, "face 2 differ by 11 %")])
def test_layers_of_a_face_that_do_not_carry_the_same_current(share: float, wrong: str) -> None:
    current_a = np.tile(1e-5 * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, share, share]), (50, 1))
    found = uneven_layers(FACES, (True, True), current_a)
    assert wrong in found
    assert bool(found) == bool(wrong)


def test_a_dark_face_is_not_asked() -> None:
    assert uneven_layers(FACES, (True, False), np.tile([1.0, 1.0, 1.0, 1.0, 0.0, 1e-3, 0.0, 0.0], (50, 1))) == ""


def test_encoders_and_bus_in_trouble() -> None:
    calm = {"emergency_code": np.zeros((1, 2), dtype=np.uint16), "bus_errors": np.zeros(1, dtype=np.uint32)}
    assert bus_trouble(Block(*np.zeros((3, 1)), calm), {1: 0, 2: 0}) == ""
    faulty = Block(*np.zeros((3, 1)), calm | {"emergency_code": np.array([[0, 0x7320]])})
    assert "joint 2 reports emergency 7320h, position error" in bus_trouble(faulty, {})
    assert "node 2 is at fault, error register 81h" in bus_trouble(Block(*np.zeros((3, 1)), calm), {1: 0, 2: 0x81})
    assert "3 error frames" in bus_trouble(Block(*np.zeros((3, 1)), calm | {"bus_errors": np.array([3])}), {})


def test_an_encoder_whose_readings_are_all_left_out_has_not_failed_to_answer():
    times_s = np.arange(4.0)
    angles_rad = np.array([[0.0, np.nan, np.nan]] * 4)
    plain = {"position_rad": angles_rad, "no_reading": np.array([[0, 2, 1], [0, 3, 1], [0, 3, 1], [0, 1, 1]])}
    block = Block(times_s, times_s, times_s.astype(np.int64), plain)
    assert "no answer from the encoder of joint 3" in unread([block])
    plain["no_reading"][:, 2], angles_rad[:, 2] = 0, 1.0
    assert "every reading of the encoder of joint 2 is out of the range" in unread([block])
    angles_rad[1, 1] = 1.0
    assert unread([block]) == ""
    nodes = Block(times_s, times_s, times_s.astype(np.int64), {"position_rad": np.full((4, 1), np.nan)})
    assert "no answer from the encoder of joint 1" in unread([nodes])
