"""An identified arm in a notebook: its numbers with their uncertainty, as tables and as an arm that computes.

Tables are those of pandas where it is installed, which is not required.
"""

import importlib
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples

if TYPE_CHECKING:
    from calibeam.results.identification import JudgedModel
    from calibrate.apply.correct import Corrected, ToolKinematics, Wanted
    from calibrate.apply.predicting import Placed
    from calibrate.model.model_file import ModelFile, ModelParameter

SCREEN = 30  # rows of a table that is shown by itself


def pandas_if_installed() -> Any:
    """The module where it is installed, else None."""
    try:
        return importlib.import_module("pandas")
    except ImportError:
        return None


Floats = NDArray[np.float64]
SAME = 1e-6  # of a rotation matrix: more than rounding, less than any slip
Conditions = Mapping[str, Floats | float] | None  # columns of samples.csv by name: (pose,) or one value for all
Frame = Literal["robot", "world"]  # of sigmas: the robot's own base frame, or that of the device or fixture


@dataclass(frozen=True)
class Model:
    """An identified arm: numbers with their uncertainty. `file` holds everything that model.json does."""

    file: "ModelFile"
    trust: str  # "yes", "with care" or "no"; "unknown" where the model was opened without its session
    says: str  # the verdict in one sentence
    reasons: tuple[str, ...]  # what speaks against trusting it

    def zeros(self) -> dict[int, tuple[float | None, float | None]]:
        """Joint (from 1) -> (zero, one sigma) in rad; true angle = reading + zero. (None, None): not determined."""
        found = {p.name: p for p in self.file.parameters}
        names = [name for name in found if name.startswith("joint") and name.endswith(".zero")]
        return {int(n[5:-5]): (found[n].value, found[n].sigma) for n in names}

    @property
    def parameters(self) -> Any:
        """One row a parameter: name, unit, value, sigma, low, high, undetermined; SI units.

        A pandas.DataFrame with the names as its index where pandas is installed, else a list of dictionaries.
        """
        keys = ("name", "unit", "value", "sigma", "low", "high", "undetermined")
        rows = [{key: getattr(p, key) for key in keys} for p in self.file.parameters]
        pandas = pandas_if_installed()
        return rows if pandas is None else pandas.DataFrame(rows, columns=list(keys)).set_index("name")

    def __getitem__(self, name: str) -> "ModelParameter":
        """One parameter by its name in model.json, SI units. KeyError for a name that the model does not have."""
        for parameter in self.file.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"'{name}': no parameter of the model; it has {', '.join(p.name for p in self.file.parameters)}")

    def flange(self, q_rad: Floats, conditions: Conditions = None, *, same_session: bool = False) -> Floats:
        """T_base_flange (pose, 4, 4), m, at joint readings (pose, joint) or (joint,), rad, with the model's effects.

        `conditions`: columns of samples.csv by name, (pose,) or one value for all poses: payload_kg, approach2,
        temp_arm_degC, ... (`file.needs` lists those that the effects need). A missing one is named in a UserWarning,
        taken as the mean of the model's session, and widens `flange_sigma`. `same_session`: as of `predict`. DataError
        where an effect cannot be evaluated.
        """
        return self._placed(q_rad, conditions, same_session).T_base_flange

    def flange_sigma(
        self, q_rad: Floats, conditions: Conditions = None, *, same_session: bool = False, frame: Frame = "robot"
    ) -> Floats:
        """(pose, 6) one sigma of `flange`: m along x, y, z of the base, rad about them. NaN without a covariance.

        In the frame "robot": uncertainty of geometry and physics, as seen from the base frame that lies best on the arm
        over its joint limits; where the base stands and how it is turned is no part of it. In the frame "world" that
        counts, too: where only a device of unknown place has seen the arm, it is most of it. Without noise of any
        instrument.
        """
        return self._placed(q_rad, conditions, same_session, frame).flange_sigma

    def tip(self, q_rad: Floats, conditions: Conditions = None, *, same_session: bool = False) -> Floats:
        """(pose, 3) target or probe tip in the base, m; arguments, warnings and errors as of `flange`.

        Where neither rig nor model knows a tip, the centre of the flange.
        """
        return self._placed(q_rad, conditions, same_session).tip_m

    def tip_sigma(
        self, q_rad: Floats, conditions: Conditions = None, *, same_session: bool = False, frame: Frame = "robot"
    ) -> Floats:
        """(pose, 3) one sigma of `tip`, m; what it contains in either frame: as of `flange_sigma`, and of the tool."""
        return self._placed(q_rad, conditions, same_session, frame).tip_sigma_m

    def predict(self, samples: Mapping[str, NDArray[np.generic]], *, same_session: bool = False) -> dict[str, Floats]:
        """Columns of predicted.csv, name -> (row,), for columns of samples.csv; effects of the model are applied.

        `same_session`: the samples are of the recording that the model was found in. DataError where an effect cannot
        be evaluated, SamplesError where joint angles or t_s are missing.
        """
        from acquisition.recording.rig import parse_rig
        from calibrate.apply.predicting import predict_with_physics

        joints = parse_rig(self.file.rig.text or "", "rig.toml in the model").n_joints
        table = Samples({name: np.asarray(values) for name, values in samples.items()}, joints)
        return predict_with_physics(self.file, table, same_session).columns

    def correct(
        self,
        poses: "Floats | Path | str",
        conditions: Conditions = None,
        *,
        near_rad: Floats | None = None,
        approach: Literal["positive", "negative"] | None = None,
        overshoot_rad: float = math.radians(2.0),
        tool: Floats | None = None,
    ) -> "Corrected":
        """Joint commands that bring the real tool to poses, as `calibeam correct` has them.

        `poses`: (pose, 4, 4) of the tool in the base, m, in the order in which they are visited; or a poses.csv.
        `conditions`: as of `flange`. `near_rad`: posture before the first pose (joint,), or one for each (pose, joint).
        `approach`: every joint comes from this side, by overshoot points `overshoot_rad` away. `tool`: (4, 4) in the
        flange, taken to be exact; by default the rig file's point for the controller, the model's for the real tool.

        Of the result: `q_rad` (pose, joint), NaN where there is no command; `T_base_tool` (pose, 4, 4) for a controller
        with the rig file's arm; `via_rad`; `before` and `after` with `error_m` and `s_error_m`; `status` and `says` of
        each pose; `notes`: what the effects lack of conditions, and what the model does not hold. DataError for poses
        or a model that cannot be used.
        """
        from acquisition.recording.rig import parse_rig
        from calibeam.motion.motion_inverse import MotionInverse
        from calibrate.apply.correct import Options, correct
        from calibrate.model.arms.rig_arm import RigArm

        rig = parse_rig(self.file.rig.text or "", "rig.toml in the model")
        wanted = _wanted(poses, conditions or {}, near_rad, rig.n_joints)
        side = {"positive": 1, "negative": -1, None: 0}[approach]
        options = Options(None if tool is None else np.asarray(tool, dtype=np.float64), side, overshoot_rad)
        return correct(self.file, wanted, MotionInverse(RigArm.of_rig(rig)), options)

    def forward(
        self, q_rad: Floats, conditions: Conditions = None, *, tool: Floats | None = None, nominal: bool = False
    ) -> Floats:
        """T_base_tool (pose, 4, 4), m, of the real tool at joint readings (pose, joint) or (joint,), rad, with physics.

        `conditions`: as of `flange`; `tool`: as of `correct`. What is missing or beyond its recorded range is named in
        a UserWarning. `nominal`: of the rig file's arm instead, where a controller or planner that computes with it has
        the tool. DataError for joints of another shape, and where an effect cannot be evaluated.
        """
        q, known = np.atleast_2d(np.asarray(q_rad, dtype=np.float64)), self._kinematics(tool)
        if nominal:
            return known.nominal(q)
        T, notes = known.forward(q, _columns(conditions, len(q)))
        _warn(notes)
        return T

    def inverse(
        self, T_base_tool: Floats, conditions: Conditions = None, *, near_rad: Floats, tool: Floats | None = None
    ) -> Floats:
        """Joint readings (pose, joint), rad, at which `forward` gives the poses (pose, 4, 4) or (4, 4) within 1e-9.

        `near_rad` (joint,) or (pose, joint): the nearest posture of the nominal arm is where the search starts.
        Conditions count as stated: nothing follows from the order of the poses. `tool`: as of `correct`. DataError
        names the first pose that has no joints, with the reason; a UserWarning a pose near a singular posture, one that
        an effect which jumps does not let the tool reach, and what `forward` warns of.
        """
        from calibeam.motion.motion_inverse import MotionInverse
        from calibrate.errors import DataError

        known = self._kinematics(tool)
        n, near = known.arms.n_joints, np.asarray(near_rad, dtype=np.float64)
        wanted = _wanted(np.asarray(T_base_tool, dtype=np.float64), conditions or {}, None, n)
        if near.shape not in ((n,), (len(wanted), n)) or not np.isfinite(near).all():
            raise DataError(f"near_rad of shape {near.shape}: give ({n},) or ({len(wanted)}, {n}), all finite, in rad")
        wanted.near_rad[:] = near
        q_rad, notes = known.inverse(replace(wanted, in_order=False), MotionInverse(known.arms.drawn))
        _warn(notes)
        return q_rad

    @cached_property
    def _tools(self) -> "dict[bytes | None, ToolKinematics]":
        """By the bytes of the tool's pose: what is worked out once."""
        return {}

    def _kinematics(self, tool: Floats | None) -> "ToolKinematics":
        from calibrate.apply.correct import Arms, Options, ToolKinematics

        stated = None if tool is None else np.asarray(tool, dtype=np.float64)
        key = None if stated is None else stated.tobytes()
        if key not in self._tools:
            options = Options(stated)
            self._tools[key] = ToolKinematics(Arms.of(self.file, options), options)
        return self._tools[key]

    def _placed(self, q_rad: Floats, conditions: Conditions, same_session: bool, frame: Frame = "robot") -> "Placed":
        """ValueError for a frame of another name."""
        from calibrate.apply.predicting import placed

        if frame not in get_args(Frame):
            raise ValueError(f"frame '{frame}': give one of {', '.join(get_args(Frame))}")
        q = np.atleast_2d(np.asarray(q_rad, dtype=np.float64))
        columns = _columns(conditions, len(q))
        joints = {f"q{i + 1}_rad": column for i, column in enumerate(q.T)}
        samples = Samples({"t_s": np.zeros(len(q))} | columns | joints, q.shape[1])
        found = placed(self.file, samples, same_session, in_world=frame == "world")
        for note in found.notes:
            warnings.warn(note, stacklevel=3)
        return found

    def save(self, path: Path | str) -> Path:
        """Write model.json; returns the path. OSError where it cannot be written."""
        from calibrate.model.model_file import write_model

        write_model(Path(path), self.file)
        return Path(path)

    def export(self, form: str, path: Path | str) -> tuple[str, ...]:
        """Write the arm for another program, by a word of `calibeam export-model --to` such as "urdf".

        Returns sentences on what the file cannot carry; they stand in it, too. DataError for an arm that the form
        cannot hold and for a form that there is not, OSError where it cannot be written.
        """
        from acquisition.recording.rig import parse_rig
        from calibrate.apply.export import export_model, form_named

        rig = parse_rig(self.file.rig.text or "", "rig.toml in the model")
        return export_model(Path(path), rig, self.file, form_named(form))

    def __repr__(self) -> str:
        return f"<calibeam.Model of {self.file.rig.name}: {self.says}>"

    def _repr_html_(self) -> str:
        """One screen in a notebook: the verdict, what speaks against it, the parameters with one sigma."""
        rows = "".join(f"<tr><td>{escape(p.name)}</td>{_cells(p)}</tr>" for p in self.file.parameters[:SCREEN])
        more = len(self.file.parameters) - SCREEN
        rest = f"<p>and {more} more: <code>model.parameters</code></p>" if more > 0 else ""
        reasons = "".join(f"<li>{escape(reason)}</li>" for reason in self.reasons)
        head = "<tr><th>parameter</th><th>value</th><th>one sigma</th><th>unit</th></tr>"
        return f"<p><b>{escape(self.says)}</b></p><ul>{reasons}</ul><table>{head}{rows}</table>{rest}"

    def __str__(self) -> str:
        from calibrate.quantities import angle_with_sigma

        lines = [self.says, *(f"  {reason}" for reason in self.reasons)]
        for joint, (zero, sigma) in self.zeros().items():
            value_text = "not determined" if zero is None or sigma is None else angle_with_sigma(zero, sigma)
            lines.append(f"joint {joint} zero: {value_text}")
        return "\n".join(lines)


def open_model(path: Path | str) -> Model:
    """A model.json of `calibeam identify` or `diagnose`. DataError where it is none, with the reason.

    What speaks for or against trusting it is seen from its session only: `calibeam.open(...).identify()`.
    """
    from calibrate.model.model_file import read_model

    file = read_model(Path(path))
    says = f"{file.status}, {file.poses} poses; how far it can be trusted is in the report of its session"
    return Model(file, "unknown", says, ())


def _wanted(
    poses: "Floats | Path | str", conditions: "Mapping[str, Floats | float]", near_rad: Floats | None, joints: int
) -> "Wanted":
    """DataError for poses that are no rigid motions."""
    from calibrate.apply.correct import Wanted, read_poses
    from calibrate.errors import DataError

    if isinstance(poses, Path | str):
        every = {name: float(value) for name, value in conditions.items()}
        try:
            text = Path(poses).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise DataError(f"{poses}: cannot be read: {error}") from error
        wanted = read_poses(text, str(poses), joints, np.eye(4), every)
    else:
        given = np.asarray(poses, dtype=np.float64)
        T = given[None] if given.ndim == 2 else given
        if T.shape[1:] != (4, 4) or not _are_rigid(T).all():
            raise DataError(f"poses of shape {given.shape}: give (pose, 4, 4), each a rotation and a position in m")
        n = len(T)
        nothing = np.full((n, joints), np.nan)
        wanted = Wanted(T, nothing, nothing.copy(), _columns(conditions, n))
    if near_rad is not None:
        near = np.asarray(near_rad, dtype=np.float64)
        if near.ndim == 2:
            wanted.near_rad[:] = near
        elif not np.isfinite(wanted.near_rad[0]).all():
            wanted.near_rad[0] = near
    return wanted


def _are_rigid(T: Floats) -> NDArray[np.bool_]:
    """(pose,) whether it is a right-handed rotation and a finite position."""
    finite = np.isfinite(T).all(axis=(1, 2))
    known = np.where(np.isfinite(T), T, 0.0)
    turn = known[:, :3, :3]
    square = np.max(np.abs(turn @ np.swapaxes(turn, 1, 2) - np.eye(3)), axis=(1, 2), initial=0.0) < SAME
    last = np.all(known[:, 3] == np.array([0.0, 0.0, 0.0, 1.0]), axis=1)
    return np.asarray(finite & square & (np.linalg.det(turn) > 0.0) & last)


def _columns(conditions: Conditions, n: int) -> dict[str, Floats]:
    """Each (pose,). DataError for one of another length."""
    from calibrate.errors import DataError

    out: dict[str, Floats] = {}
    for name, value in (conditions or {}).items():
        given = np.asarray(value, dtype=np.float64)
        if given.shape not in ((), (1,), (n,)):
            raise DataError(f"condition {name} of shape {given.shape}: give one value, or one for each of {n} poses")
        out[name] = np.array(np.broadcast_to(given, n))
    return out


def _warn(notes: tuple[str, ...]) -> None:
    """At the line that called `forward` or `inverse`."""
    for note in notes:
        warnings.warn(note, stacklevel=3)


def model_of(found: "JudgedModel") -> Model:
    return Model(found.model, found.verdict.trust.value, found.verdict.sentence, found.verdict.reasons)


def _cells(parameter: "ModelParameter") -> str:
    if parameter.value is None or parameter.sigma is None:
        return f'<td colspan="3">not determined: {escape(parameter.undetermined or "")}</td>'
    return f"<td>{parameter.value:.6g}</td><td>{parameter.sigma:.2g}</td><td>{escape(parameter.unit)}</td>"
