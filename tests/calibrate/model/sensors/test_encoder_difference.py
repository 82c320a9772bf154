"""Second encoders against the controller's: any zero, any sense, any turn."""

import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model.sensors.catalogue import unused_columns
from calibrate.model.sensors.encoder_difference import differences, encoder_angles, not_following

JOINTS, ROWS = 3, 40
ZEROS = np.array([3.1, -0.4, 1.9])
TWIST = 1e-5 * np.sin(np.linspace(0.0, 6.0, ROWS))


def table(sense=(1.0, 1.0, 1.0), **columns) -> Samples:
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (ROWS, JOINTS))
    read = np.asarray(sense) * (q + TWIST[:, None]) + ZEROS
    each = {f"q{j + 1}_rad": q[:, j] for j in range(JOINTS)}
    each |= {f"enc{j + 1}_rad": read[:, j] % (2.0 * np.pi) for j in range(JOINTS)}
    return Samples({**each, **columns}, JOINTS)


@pytest.mark.parametrize("sense", [(1.0, 1.0, 1.0), (-1.0, 1.0, -1.0)])
def test_what_lies_between_two_encoders_is_seen_whatever_the_zero_and_the_sense(sense):
    found = differences(table(sense))
    assert found.sense.tolist() == list(sense)
    assert found.used == (1, 2, 3)
    left = found.difference_rad - found.zero_rad
    assert np.allclose(left - left.mean(axis=0), (TWIST - TWIST.mean())[:, None], atol=1e-12)


def test_the_angles_of_second_encoders_are_about_the_controllers_zero():
    samples = table((1.0, -1.0, 1.0))
    turned = encoder_angles(samples)
    away = turned.joints() - samples.joints()
    assert np.abs(away).max() < 3e-5
    assert np.allclose(np.diff(away, axis=0), np.diff(TWIST)[:, None], atol=1e-12)


def test_an_encoder_that_does_not_follow_its_joint_is_left_out_by_name():
    random_rad = np.random.default_rng(3).uniform(0.0, 6.0, ROWS)
    samples = table(enc2_rad=random_rad)
    assert differences(samples).used == (1, 3)
    assert not_following(samples) == ("enc2_rad",)
    (sentence,) = unused_columns(samples)
    assert sentence.startswith("enc2_rad does not follow joint 2")
    with pytest.raises(DataError, match="joint 2"):
        encoder_angles(samples)


def test_an_encoder_that_never_answered_is_no_fault_of_its_joint():
    samples = table(enc3_rad=np.full(ROWS, np.nan))
    assert differences(samples).used == (1, 2)
    assert not_following(samples) == ()


def test_rows_that_one_encoder_spoils_for_all_are_named_with_it():
    """Row 7 is off, row 9 blank; in row 12 no encoder was read, so that nothing is left out there."""
    columns = {name: column.copy() for name, column in table().columns.items()}
    columns["enc2_rad"][6] += 0.06
    columns["enc3_rad"][8] = np.nan
    for joint in range(1, JOINTS + 1):
        columns[f"enc{joint}_rad"][11] = np.nan
    off, blank = unused_columns(Samples(columns, JOINTS))
    assert off.startswith("enc2_rad is more than 0.05 rad off its usual difference from the joint in 1 of 40 rows (7):")
    assert blank.startswith("enc3_rad holds no number in 1 of 40 rows (9): no second encoder is used in these rows")
    assert unused_columns(table()) == ()


def test_a_session_without_second_encoders_has_no_difference():
    q = {f"q{j + 1}_rad": np.zeros(ROWS) for j in range(JOINTS)}
    assert differences(Samples(q, JOINTS)) is None
