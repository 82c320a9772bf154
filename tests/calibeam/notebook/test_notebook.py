"""What a notebook sees: sessions from arrays, tables of pandas where it is there, one line and one screen, errors."""

import re
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import calibeam

TRACKER = Path(__file__).parents[2] / "golden" / "data" / "formats" / "tracker"


@pytest.fixture(scope="module")
def opened() -> "calibeam.Session":
    return calibeam.open(TRACKER)


@pytest.fixture(scope="module")
def model(opened) -> "calibeam.Model":
    return opened.identify()


def test_a_session_of_arrays_gives_the_same_arm_as_the_folder(opened, model) -> None:
    columns = dict(opened.recording.samples.columns)
    joints = opened.recording.rig.n_joints
    q_rad = np.stack([columns.pop(f"q{i + 1}_rad") for i in range(joints)], axis=1)
    positions_m = np.stack([columns.pop(name) for name in ("x_m", "y_m", "z_m")], axis=1)
    session = calibeam.session(TRACKER / "rig.toml", q_rad, positions_m, **columns)
    for name, values in opened.recording.samples.columns.items():
        assert np.array_equal(session.recording.samples.columns[name], values)
    same = session.identify()
    assert [p.value for p in same.file.parameters] == [p.value for p in model.file.parameters]


@pytest.mark.parametrize(
    ("q_shape", "positions_shape", "more", "says"),
    [
        ((5, 4), (5, 3), {}, "give (row, 3)"),
        ((5,), (5, 3), {}, "q_rad of shape"),
        ((5, 3), (4, 3), {}, "positions_m of shape"),
        ((5, 3), (5, 3), {"payload_kg": np.zeros(4)}, "payload_kg of shape"),
    ],
)
def test_arrays_that_do_not_fit_are_refused_with_the_shape_they_need(q_shape, positions_shape, more, says) -> None:
    with pytest.raises(calibeam.SamplesError, match=re.escape(says)):
        calibeam.session(TRACKER / "rig.toml", np.zeros(q_shape), np.zeros(positions_shape), **more)


@pytest.mark.parametrize("q_rad", ["joints.csv", [[0.1, 0.2, 0.3], [0.1]], np.zeros((5, 3)) + 1j, None])
def test_what_is_no_array_of_numbers_is_refused_with_its_name(q_rad) -> None:
    with pytest.raises(calibeam.SamplesError, match="q_rad is no array of real numbers"):
        calibeam.session(TRACKER / "rig.toml", q_rad, np.zeros((5, 3)))


def test_a_line_and_a_screen_say_what_it_is(opened, model) -> None:
    assert "\n" not in repr(opened) + repr(model)
    assert len(repr(model)) < 300
    assert "x_m" in opened._repr_html_()
    page = model._repr_html_()
    assert model.says.split()[0] in page
    assert model.file.parameters[0].name in page


def test_parameters_are_rows_with_sigma_or_with_the_reason_why_there_is_none(model) -> None:
    rows = model.parameters if isinstance(model.parameters, list) else model.parameters.reset_index().to_dict("records")
    assert {row["name"] for row in rows} == {p.name for p in model.file.parameters}
    assert all((row["value"] is None) != (row["undetermined"] is None) for row in rows)


def test_tables_are_of_pandas_where_it_is_installed(opened, model, monkeypatch) -> None:
    """A stand-in for the module: what is checked is what it is given."""
    made = []

    class DataFrame:
        def __init__(self, data, columns=None) -> None:
            self.data, self.columns = data, columns
            made.append(self)

        def set_index(self, name: str) -> "DataFrame":
            assert name in (self.columns or ())
            return self

    monkeypatch.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=DataFrame))
    assert opened.samples is made[0]
    assert "q1_rad" in made[0].data
    assert model.parameters is made[1]
    assert made[1].columns[0] == "name"


def test_a_model_is_exported_by_the_word_of_the_command_line(model, tmp_path) -> None:
    model.export("urdf", tmp_path / "arm.urdf")
    assert "<robot" in (tmp_path / "arm.urdf").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="no-such"):
        model.export("no-such", tmp_path / "x")


def test_errors_are_had_from_the_top_and_names_complete(tmp_path) -> None:
    assert {name for name in dir(calibeam) if not name.startswith("_")} == set(calibeam.__all__)
    with pytest.raises(calibeam.RecordingError):
        calibeam.open(tmp_path)
    assert all(getattr(calibeam, name) is not None for name in calibeam.__all__)
    with pytest.raises(AttributeError, match="no_such"):
        _ = calibeam.no_such
