"""A recording in a notebook: opened, identified, diagnosed, drawn and reported; or made of arrays in memory."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, RecordingError, Samples, SamplesError, read
from calibeam.notebook.model import SCREEN, Model, model_of, pandas_if_installed
from calibrate.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from calibeam.results.identification import JudgedModel, ReadingErrors
    from calibrate.diagnose.record.schema import DiagnosisFile

Floats = NDArray[np.float64]

BEFORE, AFTER = "#d55e00", "#0072b2"  # Okabe and Ito, Color Universal Design, 2008
MICRO = 1e6


@dataclass(frozen=True)
class Session:
    """A recording that is open. Nothing of it is ever changed; what was computed once is kept."""

    recording: Recording

    @property
    def samples(self) -> Any:
        """Settled samples, one row a pose, SI units in the names of the columns.

        A pandas.DataFrame where pandas is installed, else a dictionary, column -> (row,).
        """
        columns = dict(self.recording.samples.columns)
        pandas = pandas_if_installed()
        return columns if pandas is None else pandas.DataFrame(columns)

    def identify(self, plan: Path | str | None = None) -> Model:
        """The arm by all instruments of the recording, as `calibeam identify` does; `plan`: a fit.toml.

        DataError where nothing can be identified, with the reason.
        """
        if plan is None:
            return model_of(self._modelled)
        from calibeam.results.identification import Planned, identify_and_judge

        return model_of(identify_and_judge(self.recording, Planned.read(Path(plan))))

    fit = identify  # what other libraries call it

    def diagnose(self) -> "DiagnosisFile":
        """What the model lacks: `verdict`, `findings` with size and uncertainty, `next`; fields are those of
        diagnosis.json.

        DataError where the recording holds too little.
        """
        return self._diagnosis

    def plot(self) -> "Figure":
        """Error of every reading before and after the fit, along the session, as a matplotlib Figure.

        Lengths of the misfit in µm on a logarithmic axis, one panel an instrument and quantity.
        """
        return _errors_along_session(self._modelled.errors)

    def report(self, path: Path | str, *, diagnosis: bool = False) -> Path:
        """Write the report, one HTML file that needs no other; returns its path. With `diagnosis` also its pages.

        DataError where it cannot be written, or the recording holds nothing to fit.
        """
        from calibeam.results.session_results import write_recording_report

        write_recording_report(self.recording, self._modelled.model, Path(path), self.diagnose() if diagnosis else None)
        return Path(path)

    def __repr__(self) -> str:
        return f"<calibeam.Session {self}>"

    def _repr_html_(self) -> str:
        """One screen in a notebook: what was recorded, and from where to where each column goes."""
        samples = self.recording.samples
        rows = "".join(_range_row(name, samples) for name in samples.names[:SCREEN])
        head = "<tr><th>column</th><th>least</th><th>most</th><th>missing</th></tr>"
        return f"<p><b>{escape(str(self))}</b></p><table>{head}{rows}</table>"

    def __str__(self) -> str:
        r = self.recording
        whole = "" if r.complete else ", cut short or damaged"
        return f"{r.path.name}: rig {r.rig.name}, {r.rig.n_joints} joints, {len(r.samples)} samples{whole}"

    @cached_property
    def _modelled(self) -> "JudgedModel":
        from calibeam.results.identification import identify_and_judge

        return identify_and_judge(self.recording)

    @cached_property
    def _diagnosis(self) -> "DiagnosisFile":
        from calibeam.results.diagnosis import diagnose_recording

        found, file = diagnose_recording(self.recording)
        if found.physics is None:
            raise DataError(found.why_not)
        return file


def open_recording(path: Path | str) -> Session:
    """A recording (.mcap) or session folder. RecordingError where it is neither, with the reason."""
    if Path(path).suffix == ".json":
        raise RecordingError(f"{path}: a recording or a session folder is opened here; open a model with open_model")
    return Session(read(Path(path)))


def session_of_arrays(
    rig: Path | str, q_rad: Floats, positions_m: Floats | None = None, **columns: "NDArray[np.generic]"
) -> Session:
    """A session of readings that are in memory: rig file, joint readings (row, joint) rad, and what was measured.

    `positions_m`: (row, 3) of a tracker. Every other column of samples.csv by its name, (row,): `psd1_x_m`, `wire_m`,
    `payload_kg`, ... Without `t_s` the rows count as taken a second apart, in their order. RigFileError for the rig,
    SamplesError for a table that does not fit it.
    """
    from acquisition.recording.rig import load_rig, rig_text
    from acquisition.recording.session_folder import check_header, parse_csv

    loaded, q = load_rig(rig), _numbers(q_rad, "q_rad")
    if q.ndim != 2 or q.shape[1] != loaded.n_joints:
        raise SamplesError(f"q_rad of shape {q.shape}: give (row, {loaded.n_joints}), as {rig} has that many joints")
    table: dict[str, NDArray[np.generic]] = {"t_s": np.arange(len(q), dtype=np.float64)}
    table |= {f"q{i + 1}_rad": column for i, column in enumerate(q.T)}
    if positions_m is not None:
        positions = _numbers(positions_m, "positions_m")
        if positions.shape != (len(q), 3):
            raise SamplesError(f"positions_m of shape {positions.shape}: give ({len(q)}, 3), one place a row of q_rad")
        table |= dict(zip(("x_m", "y_m", "z_m"), positions.T, strict=True))
    table |= {name: np.asarray(values) for name, values in columns.items()}
    check_header(table, "the arrays")
    wrong = [name for name, values in table.items() if values.shape != (len(q),)]
    if wrong:
        raise SamplesError(f"{wrong[0]} of shape {table[wrong[0]].shape}: give ({len(q)},), one value a row of q_rad")
    lines = [",".join(table), *(",".join(map(_cell, row)) for row in zip(*table.values(), strict=True))]
    samples = parse_csv("\n".join(lines) + "\n", "the arrays", loaded)
    return Session(Recording(path=Path(rig), rig_text=rig_text(rig), rig=loaded, samples=samples, complete=True))


def _numbers(values: object, name: str) -> Floats:
    try:
        return np.asarray(values).astype(np.float64, casting="same_kind")
    except (TypeError, ValueError):
        raise SamplesError(f"{name} is no array of real numbers; give rows of equal length") from None


def _cell(value: Any) -> str:
    """As a cell of samples.csv, without loss; empty where missing."""
    if isinstance(value, str):
        return value
    return "" if value != value else repr(value.item())


def _range_row(name: str, samples: Samples) -> str:
    values = samples.columns[name]
    if values.dtype.kind != "f":
        return f'<tr><td>{escape(name)}</td><td colspan="2">text</td><td>{int((values == "").sum())}</td></tr>'
    known = values[np.isfinite(values)]
    least, most = (f"{known.min():.6g}", f"{known.max():.6g}") if known.size else ("", "")
    return f"<tr><td>{escape(name)}</td><td>{least}</td><td>{most}</td><td>{len(values) - known.size}</td></tr>"


def _errors_along_session(found: "Sequence[ReadingErrors]") -> "Figure":
    """One panel a quantity; µm, of orientations µrad, on a logarithmic axis."""
    from matplotlib.figure import Figure  # takes a second to load

    figure = Figure(figsize=(8.0, 1.0 + 2.4 * len(found)), layout="constrained")
    for axes, one in zip(figure.subplots(len(found), 1, squeeze=False).ravel(), found, strict=True):
        number = np.arange(len(one.after)) + 1
        for values, colour, mark, label in (
            (one.before, BEFORE, "x", "nominal arm"),
            (one.after, AFTER, "o", "identified"),
        ):
            axes.plot(number, MICRO * _positive(values), mark, ms=4, color=colour, label=f"{label}: {_rms(values)} rms")
        unit = "µm" if one.unit == "m" else "µrad"
        axes.set(yscale="log", xlabel="reading", ylabel=f"error ({unit})", title=one.title)
        axes.legend(loc="best", fontsize=9)
    return figure


def _positive(values: Floats) -> Floats:
    """What a logarithmic axis can show; NaN draws nothing."""
    return np.where(values > 0.0, values, np.nan)


def _rms(values: Floats) -> str:
    return f"{MICRO * float(np.sqrt(np.mean(values**2))):.3g}"
