"""MATLAB script of an identified arm: a struct with matrices and D-H table, and a rigidBodyTree built from it.

Source of the calls: MathWorks, Robotics System Toolbox, rigidBodyTree, rigidBodyJoint, setFixedTransform(joint, tform):
the fixed transform stands in front of the turn about z.
"""

from collections.abc import Iterable

from acquisition.recording.rig import ArmModel
from calibrate.apply.export.dh_csv import dh_numbers
from calibrate.apply.export.identified import IdentifiedArm
from calibrate.model.arms.convert import convert

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
