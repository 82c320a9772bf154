"""A real arm that no device has measured: pairs of sockets, judged on a place that the fit has not seen."""

import msgspec
import numpy as np
import pytest

from benchmarks import sockets
from calibrate.errors import DataError
from calibrate.fit.identify.wrong_file import refuse_wrong_file

from . import answers

FOLDER = answers.REAL / "panda-sockets"
FROM_MEAN_M, LENGTH_ERROR_M = 0.283e-3, 0.15e-3  # of the same data: plain geometry of the recording's authors' method
SCALE = 0.002


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    if not FOLDER.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    return sockets.session_of(FOLDER, tmp_path_factory.mktemp("sockets") / "session")


def mean_errors(pairs):
    """Distance from the mean of the socket, size of the error of the distance, and scale less 1."""
    away_m = np.concatenate([pair.from_mean_m for pair in pairs])
    errors_m = np.array([pair.length_error_m for pair in pairs])
    return away_m.mean(), np.abs(errors_m).mean(), errors_m.mean() / sockets.APART_M


def test_the_nominal_arm_misses_by_millimetres(recording):
    away_m, error_m, _ = mean_errors(sockets.nominal_pairs(recording).values())
    assert away_m == pytest.approx(7.8e-3, abs=0.1e-3)
    assert error_m == pytest.approx(1.4e-3, abs=0.1e-3)


def test_all_places_give_the_scale_and_one_left_out_is_predicted(recording):
    model, _ = sockets.model_without(recording, None)
    assert not any("no length" in alarm for alarm in model.alarms)
    away_m, error_m, scale = mean_errors(sockets.pairs_of(model, recording.samples).values())
    assert away_m < 0.26e-3
    assert error_m < 0.13e-3
    assert abs(scale) < SCALE
    model, unseen = sockets.model_without(recording, 7)
    away_m, error_m, _ = mean_errors(sockets.pairs_of(model, unseen).values())
    assert away_m < FROM_MEAN_M
    assert error_m < LENGTH_ERROR_M


@pytest.mark.endure
def test_each_place_in_turn_is_predicted_to_the_published_figures(recording):
    away_m, error_m, scale = mean_errors(list(sockets.left_out(recording)))
    assert away_m <= FROM_MEAN_M
    assert error_m <= LENGTH_ERROR_M
    assert abs(scale) < SCALE


@pytest.mark.endure
def test_a_ball_that_was_fixed_again_is_named_with_its_moment_and_its_size(recording):
    seat = recording.samples.integers("seat", 0)
    first = int(np.flatnonzero(seat >= sockets.FIRST_REFITTED)[0])
    found = sockets.found_again(recording, sockets.FIRST_REFITTED, sockets.REFITTED_M)
    (moved,) = [f for f in found if f.confidence > 0.5]
    assert moved.parameters["time_s"].value == pytest.approx(first - 0.5, abs=1.0)  # rows stand a second apart
    shift_m = np.array([moved.parameters[f"shift_{axis}_m"].value for axis in "xyz"])
    assert np.linalg.norm(shift_m - sockets.REFITTED_M) < 0.3e-3


@pytest.mark.parametrize(("change", "found"), [({"length_m": 0.053}, 5), ({"to_placement": 8}, 5)])
def test_a_wrong_note_of_one_place_is_named(recording, change, found):
    stated = list(recording.rig.known_distances)
    refuse_wrong_file(recording.rig, recording.samples)
    stated[2] = msgspec.structs.replace(stated[2], **change)
    rig = msgspec.structs.replace(recording.rig, known_distances=tuple(stated))
    with pytest.raises(
        DataError, match=f"seats {found} and {stated[2].to_placement} are .* mm apart by the rig"
    ) as wrong:
        refuse_wrong_file(rig, recording.samples)
    assert str(wrong.value).count("known_distance:") == 1
