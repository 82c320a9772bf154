"""For notebooks and scripts: a recording opened, identified, diagnosed, drawn and reported in a few lines.

    import calibeam

    session = calibeam.open("recording.mcap")
    model = session.identify()

The same functions stand behind the command line; docs/python.md has all of it as examples.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples, read
from calibrate.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from calibeam.results.identification import JudgedModel, ReadingErrors
    from calibrate.diagnose.schema import DiagnosisFile
    from calibrate.model_file import ModelFile, ModelParameter
    from calibrate.physics.predicting import Placed

Floats = NDArray[np.float64]
Frame = Literal["robot", "world"]  # of sigmas: the robot's own base frame, or that of the device or fixture

BEFORE, AFTER = "#d55e00", "#0072b2"  # Okabe and Ito, Color Universal Design, 2008
MICRO = 1e6


@dataclass(frozen=True)
class Model:
    """An identified arm: numbers with their doubt. `file` holds everything that model.json does."""

    file: "ModelFile"
    trust: str  # "good", "care" or "bad"
    says: str  # the verdict in one sentence
    reasons: tuple[str, ...]  # what speaks against trusting it

    def zeros(self) -> dict[int, tuple[float | None, float | None]]:
        """Joint (from 1) -> (zero, one sigma) in rad; true angle = reading + zero. (None, None): not determined."""
        found = {p.name: p for p in self.file.parameters}
        names = [name for name in found if name.startswith("joint") and name.endswith(".zero")]
        return {int(n[5:-5]): (found[n].value, found[n].sigma) for n in names}

    def __getitem__(self, name: str) -> "ModelParameter":
        """One parameter by its name in model.json, SI units. KeyError for a name that the model does not have."""
        for parameter in self.file.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"'{name}': no parameter of the model; it has {', '.join(p.name for p in self.file.parameters)}")

    def flange(
        self, q_rad: Floats, conditions: "Mapping[str, Floats | float] | None" = None, *, same_session: bool = False
    ) -> Floats:
        """T_base_flange (pose, 4, 4), m, at joint readings (pose, joint) or (joint,), rad, with the model's effects.

        `conditions`: columns of samples.csv by name, (pose,) or one value for all poses: payload_kg, approach2,
        temp_arm_degC, ... (`file.needs` lists those that the effects need). A missing one is named in a UserWarning,
        taken as the mean of the model's session, and widens `flange_sigma`. `same_session`: as of `predict`. DataError
        where an effect cannot be evaluated.
        """
        return self._placed(q_rad, conditions, same_session).T_base_flange

    def flange_sigma(
        self,
        q_rad: Floats,
        conditions: "Mapping[str, Floats | float] | None" = None,
        *,
        same_session: bool = False,
        frame: Frame = "robot",
    ) -> Floats:
        """(pose, 6) one sigma of `flange`: m along x, y, z of the base, rad about them. NaN without a covariance.

        In the frame "robot": doubt of geometry and physics, as seen from the base frame that lies best on the arm over
        its joint limits; where the base stands and how it is turned is no part of it. In the frame "world" that counts,
        too: where only a device of unknown place has seen the arm, it is most of it. Without noise of any instrument.
        """
        return self._placed(q_rad, conditions, same_session, frame).flange_sigma

    def tip(
        self, q_rad: Floats, conditions: "Mapping[str, Floats | float] | None" = None, *, same_session: bool = False
    ) -> Floats:
        """(pose, 3) target or probe tip in the base, m; arguments, warnings and errors as of `flange`.

        Where neither rig nor model knows a tip, the centre of the flange.
        """
        return self._placed(q_rad, conditions, same_session).tip_m

    def tip_sigma(
        self,
        q_rad: Floats,
        conditions: "Mapping[str, Floats | float] | None" = None,
        *,
        same_session: bool = False,
        frame: Frame = "robot",
    ) -> Floats:
        """(pose, 3) one sigma of `tip`, m; what it contains in either frame: as of `flange_sigma`, and of the tool."""
        return self._placed(q_rad, conditions, same_session, frame).tip_sigma_m

    def predict(self, samples: Mapping[str, NDArray[np.generic]], *, same_session: bool = False) -> dict[str, Floats]:
        """Columns of predicted.csv, name -> (row,), for columns of samples.csv; effects of the model are applied.

        `same_session`: the samples are of the recording that the model was found in. DataError where an effect cannot
        be evaluated, SamplesError where joint angles or t_s are missing.
        """
        from acquisition.recording.rig import parse_rig
        from calibrate.physics.predicting import predict_with_physics

        joints = parse_rig(self.file.rig.text or "", "rig.toml in the model").n_joints
        table = Samples({name: np.asarray(values) for name, values in samples.items()}, joints)
        return predict_with_physics(self.file, table, same_session).columns

    def _placed(
        self,
        q_rad: Floats,
        conditions: "Mapping[str, Floats | float] | None",
        same_session: bool,
        frame: Frame = "robot",
    ) -> "Placed":
        """ValueError for a frame of another name."""
        from calibrate.physics.predicting import placed

        if frame not in get_args(Frame):
            raise ValueError(f"frame '{frame}': give one of {', '.join(get_args(Frame))}")
        q = np.atleast_2d(np.asarray(q_rad, dtype=np.float64))
        columns = {name: np.broadcast_to(value, len(q)) for name, value in (conditions or {}).items()}
        joints = {f"q{i + 1}_rad": column for i, column in enumerate(q.T)}
        samples = Samples({"t_s": np.zeros(len(q))} | columns | joints, q.shape[1])
        found = placed(self.file, samples, same_session, in_world=frame == "world")
        for note in found.notes:
            warnings.warn(note, stacklevel=3)
        return found

    def save(self, path: Path | str) -> Path:
        """Write model.json; returns the path. OSError where it cannot be written."""
        from calibrate.model_file import write_model

        write_model(Path(path), self.file)
        return Path(path)

    def __str__(self) -> str:
        lines = [self.says, *(f"  {reason}" for reason in self.reasons)]
        for joint, (zero, sigma) in self.zeros().items():
            told = "not determined" if zero is None or sigma is None else f"{zero:+.6f} ± {sigma:.6f} rad"
            lines.append(f"joint {joint} zero: {told}")
        return "\n".join(lines)


@dataclass(frozen=True)
class Session:
    """A recording that is open. Nothing of it is ever changed; what was computed once is kept."""

    recording: Recording

    @property
    def samples(self) -> dict[str, NDArray[np.generic]]:
        """Settled samples, column -> (row,), SI units in the names; `pandas.DataFrame(session.samples)` takes it."""
        return dict(self.recording.samples.columns)

    def identify(self, plan: Path | str | None = None) -> Model:
        """The arm by all instruments of the recording, as `calibeam identify` does; `plan`: a fit.toml.

        DataError where nothing can be identified, with the reason.
        """
        if plan is None:
            return _model(self._modelled)
        from calibeam.results.identification import Planned, identify_and_judge

        return _model(identify_and_judge(self.recording, Planned.read(Path(plan))))

    fit = identify  # what other libraries call it

    def diagnose(self) -> "DiagnosisFile":
        """What the model lacks: `verdict`, `findings` with size and doubt, `next`; fields are those of diagnosis.json.

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
            raise DataError("; besides, ".join(blunder.says for blunder in found.blunders))
        return file


def open_recording(path: Path | str) -> Session:
    """A recording (.mcap) or session folder. RecordingError where it is neither, with the reason."""
    return Session(read(Path(path)))


def _model(found: "JudgedModel") -> Model:
    return Model(found.model, found.verdict.trust.value, found.verdict.sentence, found.verdict.reasons)


def _errors_along_session(found: "Sequence[ReadingErrors]") -> "Figure":
    """One panel a quantity; µm, of orientations µrad, on a logarithmic axis."""
    from matplotlib.figure import Figure  # takes a second to load

    figure = Figure(figsize=(8.0, 1.0 + 2.4 * len(found)), layout="constrained")
    for axes, one in zip(figure.subplots(len(found), 1, squeeze=False).ravel(), found, strict=True):
        number = np.arange(len(one.after)) + 1
        for values, colour, mark, label in (
            (one.before, BEFORE, "x", "arm as drawn"),
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
