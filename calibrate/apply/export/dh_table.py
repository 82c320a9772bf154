"""The standard D-H table of an identified arm, as CSV and as MATLAB script, and what the data determine of its numbers.

CSV: base, one row a joint with the tilt of Hayati, flange. MATLAB: a struct with matrices and D-H table, and a
rigidBodyTree built from it (MathWorks, Robotics System Toolbox, rigidBodyTree, rigidBodyJoint, setFixedTransform(joint,
tform): the fixed transform stands in front of the turn about z). Where the arm was fitted as poses, each number is a
function of the fitted parameters. A number that an unseen combination moves is not determined (Rao, as in
fit/rank/identifiability.py).
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel, Pose, Rig
from calibrate.apply.export.identified import NO_NUMBER, IdentifiedArm, identified_arm
from calibrate.fit.identify.estimates import ONLY_ASSUMED
from calibrate.fit.rank import STRUCTURAL, Identifiability, combinations_of
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import Conversion, convert, pose_of
from calibrate.model.arms.link_tolerance import LINK_PLAUSIBLE, ZERO_PLAUSIBLE_RAD
from calibrate.model.arms.table import NEAR_PARALLEL_SINE
from calibrate.model.model_file import ModelFile, ModelParameter
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]

TABLE = ("theta_offset_rad", "d_m", "a_m", "alpha_rad", "tilt_rad")
FRAME = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")


def dh_csv_text(arm: IdentifiedArm) -> str:
    """The file's text; lines with # are its explanation."""
    new = convert(arm.rig.arm, ArmModel.DH, arm.corrections)
    lines = [
        "# Standard Denavit-Hartenberg table, identified by calibeam; m and rad",
        "# T_base_flange = base T_1 ... T_n flange; T_i = Rz(q_i + theta_offset) Tz(d) Tx(a) Rx(alpha) Ry(tilt)",
        f"# {arm.sign}",
        *(f"# {says}" for says in arm.not_carried),
        "# base and flange: origin x, y, z and rotation vector rx, ry, rz (axis times angle)",
        ",".join(("row", *TABLE, *FRAME)),
        _frame("base", pose_of(new.T_base_new)),
        *(
            ",".join((str(i), *(repr(v) for v in row), *("" for _ in FRAME)))
            for i, row in enumerate(dh_numbers(new), start=1)
        ),
        _frame("flange", new.arm.flange),
    ]
    return "\n".join(lines) + "\n"


def dh_numbers(new: Conversion) -> list[tuple[float, float, float, float, float]]:
    """A row a joint: theta offset, d, a, alpha, tilt."""
    return [
        (
            j.theta_offset_rad or 0.0,
            j.d_m or 0.0,
            j.a_m or 0.0,
            j.alpha_rad or 0.0,
            new.corrections.get(f"link{i}.tilt", 0.0),
        )
        for i, j in enumerate(new.arm.joints, start=1)
    ]


def _frame(name: str, pose: Pose) -> str:
    return ",".join((name, *("" for _ in TABLE), *(repr(v) for v in (*pose.origin_m, *pose.rotation_rad))))


NAMES = ("joint{}.zero", "link{}.offset", "link{}.length", "link{}.twist", "link{}.tilt")  # of TABLE
PLAUSIBLE = (ZERO_PLAUSIBLE_RAD, *(LINK_PLAUSIBLE,) * 4)
STEP = 1e-6  # m, rad: of the differences
# An unseen combination that is off by its plausible size moves a number that is determined by less than this; it is
# part of its sigma. Slid along near-parallel axes, a length changes by the small angle between them times the slide.
PULLED = 0.05 * LINK_PLAUSIBLE  # m, rad
SMALL = 1e-6  # of a scaled direction: rounding of the differences leaves 1e-9
ONLY_PRIOR = 0.9  # of the sigma that the tolerances alone leave: beyond, the data taught nothing


def dh_arm(rig: Rig, values: Mapping[str, float], stated: Sequence[ModelParameter]) -> IdentifiedArm:
    """The arm of these corrections by its standard D-H table; `stated`: what the data determine of that table."""
    found = _corrections(rig, values)
    in_dh = replace(rig, arm=replace(convert(rig.arm, ArmModel.DH).arm, make=rig.arm.make))
    return identified_arm(in_dh, dict(zip(_names(rig), found.tolist(), strict=True)), stated=stated)


def dh_table_of(
    rig: Rig, model: ModelFile, parameters: Sequence[Parameter], seen: Identifiability
) -> tuple[ModelParameter, ...]:
    """Corrections of the standard D-H table of an arm of poses, or why the data determine none.

    `parameters` are those of the fit; `seen` is their identifiability without what is only assumed.
    """
    values = {p.name: model.chain.get(p.name, 0.0) for p in arm_of(rig).parameters}
    free = [p for p in parameters if p.free]
    covariance = _covariance(model, [p.name for p in free])
    names, nominal = _names(rig), np.array(dh_numbers(convert(rig.arm, ArmModel.DH)))
    found, J = _corrections(rig, values), np.zeros((len(names), len(free)))
    own = set(values)
    for k, name in enumerate(p.name for p in free):
        if name in own:
            up, down = ({**values, name: values[name] + step} for step in (STEP, -STEP))
            J[:, k] = (_corrections(rig, up) - _corrections(rig, down)) / (2.0 * STEP)
    together = _together(names, J, [p for p in free if p.name not in own], free, seen)
    tilted = np.abs(np.sin(nominal[:, 3])) < NEAR_PARALLEL_SINE
    tilted[-1] = False  # nothing turns behind it
    pulled, prior = np.linalg.norm(J @ seen.unseen, axis=1), np.minimum([p.prior for p in free], 1e6)
    stated = list[ModelParameter]()
    for i, name in enumerate(names):
        unit, sigma = "m" if name.endswith(("offset", "length")) else "rad", float(np.sqrt(J[i] @ covariance @ J[i]))
        moved = np.abs(J[i]) > SMALL
        why = None if sigma < ONLY_PRIOR * np.linalg.norm((J[i] * prior)[moved]) else ONLY_ASSUMED
        if pulled[i] > PULLED or not np.isfinite(sigma):
            why = together.get(name, NO_NUMBER)
        if not np.any(moved):
            why = "held at its nominal value"
        numbers = (None, None) if why else (float(found[i]), float(np.hypot(sigma, pulled[i])))
        if not name.endswith("tilt") or tilted[i // len(NAMES)]:
            stated.append(ModelParameter(name, unit, *numbers, why))
    return tuple(stated)


def _names(rig: Rig) -> list[str]:
    return [name.format(i) for i in range(1, rig.n_joints + 1) for name in NAMES]


def _corrections(rig: Rig, values: Mapping[str, float]) -> Floats:
    """(number,) of the table: calibrated less nominal."""
    calibrated, nominal = (np.array(dh_numbers(convert(rig.arm, ArmModel.DH, of))) for of in (values, {}))
    apart = calibrated - nominal
    apart[:, [0, 3]] = np.remainder(apart[:, [0, 3]] + np.pi, 2.0 * np.pi) - np.pi
    return apart.ravel()


def _covariance(model: ModelFile, names: list[str]) -> Floats:
    """(name, name) of free parameters, zero for those that the fit held; nan where the model has none."""
    if (known := model.covariance) is None:
        return np.full((len(names),) * 2, np.nan)
    at, stated = [names.index(name) for name in known.names], {p.name: p.sigma for p in model.parameters if p.sigma}
    out = np.zeros((len(names),) * 2)
    out[np.ix_(at, at)] = known.rows
    wider = [stated[n] / np.sqrt(known.rows[k][k]) for k, n in enumerate(known.names) if n in stated]
    return out * np.median(wider or [1.0]) ** 2  # for noise known from few readings, as in these sigmas


def _together(
    names: list[str], J: Floats, others: Sequence[Parameter], free: Sequence[Parameter], seen: Identifiability
) -> dict[str, str]:
    """Number -> what it is seen together with: unseen directions in the numbers, base, target and fixture."""
    scaled = J / np.tile(PLAUSIBLE, len(names) // len(NAMES))[:, None]
    held_rows = np.array([[(p is other) / p.plausible for p in free] for other in others]).reshape(-1, len(free))
    rows = np.concatenate([scaled, held_rows]) @ seen.unseen
    rows /= max(1.0, float(np.abs(rows).max(initial=0.0)))  # of wide tolerances, their rounding is as much larger
    weakest = STRUCTURAL * seen.singular_values.max(initial=0.0)
    never = _basis(rows[:, seen.singular_values[seen.rank :] < weakest])
    basis = np.concatenate([never, _basis(rows - never @ (never.T @ rows))], axis=1)
    every = (*names, *(p.name for p in others))
    out = dict[str, str]()
    for found in combinations_of(basis, every, never.shape[1], np.linalg.norm(basis, axis=1) > SMALL):
        owners = dict.fromkeys(n if n in names else n.partition(".")[0] for n in found.spoken)
        says = dataclasses.replace(found, spoken=tuple(owners)).says
        out |= {name: says for name in found.members if name not in out}
    return out


def _basis(columns: Floats) -> Floats:
    """Orthonormal basis (row, rank) of what the columns span."""
    U, s, _ = np.linalg.svd(columns, full_matrices=False)
    return U[:, s > SMALL]


TREE = """
if exist('rigidBodyTree', 'class') == 8  % the struct alone needs no toolbox
    robot = rigidBodyTree('DataFormat', 'row');
    parent = robot.BaseName;
    for i = 1:size(arm.limits, 1)
        body = rigidBody(sprintf('link%d', i));
        joint = rigidBodyJoint(sprintf('joint%d', i), 'revolute');
        joint.PositionLimits = arm.limits(i, :);
        setFixedTransform(joint, arm.parts(:, :, i));
        body.Joint = joint;
        addBody(robot, body, parent);
        parent = body.Name;
    end
    body = rigidBody('flange');
    joint = rigidBodyJoint('flange_fixed', 'fixed');
    setFixedTransform(joint, arm.parts(:, :, end));
    body.Joint = joint;
    addBody(robot, body, parent);
end
"""


def matlab_text(arm: IdentifiedArm) -> str:
    """The script's text."""
    new = convert(arm.rig.arm, ArmModel.DH, arm.corrections)
    name = arm.rig.name.replace("'", "''").replace("\n", " ")
    lines = [
        "% Identified by calibeam; m and rad.",
        f"% {arm.sign}.",
        *(f"% {says}" for says in arm.not_carried),
        "% T_base_flange = parts(:,:,1) * Rz(q1) * parts(:,:,2) * ... * Rz(qn) * parts(:,:,n+1)",
        f"arm.name = '{name}';",
        *(f"arm.parts(:, :, {i}) = {_matrix(part.tolist())};" for i, part in enumerate(arm.parts, start=1)),
        f"arm.limits = {_matrix(arm.limits_rad)};",
        "% the same arm as a standard D-H table: base * T_1 * ... * T_n * flange,",
        "% T_i = Rz(q_i + theta_offset) Tz(d) Tx(a) Rx(alpha) Ry(tilt); columns: theta_offset d a alpha tilt",
        f"arm.dh = {_matrix(dh_numbers(new))};",
    ]
    if arm.tool_m is not None:
        lines.append(f"arm.tool_point_m = {_matrix([arm.tool_m])};  % in the flange frame")
    return "\n".join(lines) + "\n" + TREE


def _matrix(rows: Iterable[Iterable[float]]) -> str:
    return "[" + "; ".join(" ".join(repr(float(v)) for v in row) for row in rows) + "]"
