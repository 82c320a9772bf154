"""An export form: the arm as a Python module that builds an Orocos KDL chain.

Source: Orocos KDL, class Segment: the pose of a segment is that of its joint, then the fixed frame behind it.
"""

from calibrate.apply.export.export import ExportForm
from calibrate.apply.export.identified import IdentifiedArm


def text(arm: IdentifiedArm) -> str:
    """F_0 stands in front of the first joint, F_i behind joint i."""
    lines = [
        "# Identified by calibeam; m and rad.",
        f"# {arm.sign}.",
        *(f"# {says}" for says in arm.not_carried),
        "import PyKDL as kdl",
        "",
        "chain = kdl.Chain()",
    ]
    for i, part in enumerate(arm.parts.tolist()):
        joint = "kdl.Joint.Fixed" if i == 0 else "kdl.Joint.RotZ"
        rotation = ", ".join(repr(part[row][column]) for row in range(3) for column in range(3))
        origin = ", ".join(repr(part[row][3]) for row in range(3))
        frame = f"kdl.Frame(kdl.Rotation({rotation}), kdl.Vector({origin}))"
        lines.append(f"chain.addSegment(kdl.Segment(kdl.Joint({joint}), {frame}))")
    return "\n".join(lines) + "\n"


FORM = ExportForm(name="pykdl", suffix=".kdl.py", text=text)
