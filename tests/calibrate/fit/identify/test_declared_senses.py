"""Signs and couplings declared in the rig file: without them the file is refused by name, with them only noise is left.

The arms are drawn here by turns about the axes of the base, so that nothing of the rig reader stands on both sides.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import parse_rig
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from tests.calibrate.fit.identify.conftest import table

X, Y, Z = np.eye(3)
TOOL_M = np.array([0.03, 0.02, 0.06])
NOISE_M = 2e-5
DEVICE = Rotation.from_rotvec([0.1, -0.2, 0.7]), np.array([1.2, -0.4, 0.3])

# axis as the controller counts, and lengths (m) in front of it; docs/robots.md has the sources
KUKA = [
    (-Z, (0, 0, 0.4)),
    (Y, (0.025, 0, 0)),
    (Y, (0.455, 0, 0)),
    (-X, (0, 0, 0.035)),
    (Y, (0.42, 0, 0)),
    (-X, (0.08, 0, 0)),
]
FANUC = [
    (Z, (0, 0, 0.33)),
    (Y, (0.05, 0, 0)),
    (-Y, (0, 0, 0.33)),
    (-X, (0, 0, 0.035)),
    (-Y, (0.335, 0, 0)),
    (-X, (0.08, 0, 0)),
]


def tips(arm, q, zero_rad):
    """(row, 3) in the base; the tool is drawn along the axes of the base."""
    point = np.tile(TOOL_M, (len(q), 1))
    for j in reversed(range(6)):
        axis, length = arm[j]
        point = Rotation.from_rotvec((q[:, j] + zero_rad[j])[:, None] * axis).apply(point) + np.array(length)
    return point


def session(arm, couple=0.0, n=100):
    rng = np.random.default_rng(5)
    q = rng.uniform([-1.5, -1.2, -0.8, -2.0, -1.5, -2.0], [1.5, 0.6, 1.2, 2.0, 1.5, 2.0], (n, 6))
    from_links = q.copy()
    from_links[:, 2] += couple * q[:, 1]
    zero_rad = rng.normal(0.0, 1e-3, 6)
    turn, shift_m = DEVICE
    seen = turn.inv().apply(tips(arm, from_links, zero_rad) - shift_m) + rng.normal(0.0, NOISE_M, (n, 3))
    return table(q, **dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))), zero_rad


def rig_of(request, name, *left_out):
    """A shipped rig without the lines that begin with these words, its tool as drawn here."""
    text = (request.config.rootpath / "calibeam" / "shipped_rigs" / f"{name}.toml").read_text()
    text = "\n".join(line for line in text.splitlines() if not line.startswith(left_out))
    rig = parse_rig(text, name)
    R = flange_at_zero(rig)
    point = ", ".join(repr(float(v)) for v in R.T @ TOOL_M)
    text += "\n[tolerance]\nlength_m = 1e-6\nangle_rad = 1e-6\n"  # of the lengths, which are drawn exactly here
    return parse_rig(text.replace("point_m = [0.0, 0.0, 0.05]", f"point_m = [{point}]"), name)


def flange_at_zero(rig):
    out = np.eye(3)
    for joint in rig.arm.joints:
        out = out @ Rotation.from_rotvec(joint.rotation_rad).as_matrix()
    return out @ Rotation.from_rotvec(rig.arm.flange.rotation_rad).as_matrix()


def run(rig, samples):
    return identify(rig, samples, rng=np.random.default_rng(0), held_out_share=0.0)


def distance_m(found):
    return found.instruments[0].rms_distance_after_m


def test_a_kuka_without_its_signs_is_refused_with_the_line_to_write(request):
    samples, _ = session(KUKA)
    with pytest.raises(DataError, match=r"write sign = -1 for joints 1, 4 and 6, as for KUKA") as refused:
        run(rig_of(request, "kuka-kr6-r900", "sign"), samples)
    assert "less likely" in str(refused.value)  # a mirrored device is never the first explanation


def test_a_kuka_with_its_signs_leaves_noise_and_zeros_in_its_own_sense(request):
    samples, zero_rad = session(KUKA)
    found = run(rig_of(request, "kuka-kr6-r900"), samples)
    assert distance_m(found) < 2.0 * NOISE_M
    names = [parameter.name for parameter in found.parameters]
    zeros = [found.theta[names.index(f"joint{joint}.zero")] for joint in (2, 3, 4, 5)]
    np.testing.assert_allclose(zeros, zero_rad[1:5], atol=1e-4)  # joints 1 and 6 turn device and tool along


def test_a_fanuc_without_its_coupling_is_refused_with_the_line_to_write(request):
    samples, _ = session(FANUC, couple=1.0)
    with pytest.raises(DataError, match=r"write follows = \{ joint = 2, by = 1.0 \} for joint 3, as for FANUC"):
        run(rig_of(request, "fanuc-lrmate-200id", "follows"), samples)


def test_a_fanuc_with_its_coupling_leaves_noise(request):
    samples, _ = session(FANUC, couple=1.0)
    assert distance_m(run(rig_of(request, "fanuc-lrmate-200id"), samples)) < 2.0 * NOISE_M


def test_a_coupling_that_the_arm_does_not_have_is_found_too(request):
    samples, _ = session(FANUC)
    with pytest.raises(DataError, match="for joint 3, as for FANUC, or remove it there"):
        run(rig_of(request, "fanuc-lrmate-200id"), samples)
