"""Targets of an arm in the forms of four languages, and the check that the real arm reaches what a program asks for."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.apply.correct.corrected import Options
from calibrate.apply.programs import correct_program, dialect_of
from calibrate.apply.programs.rewriting import CorrectedProgram
from calibrate.model.rigid import inverse as inverse_of
from tests.calibrate.apply.correct.six_joints import drawn, inverse, model, postures, real

Floats = NDArray[np.float64]

Q: Floats = postures(6, seed=23)
T: Floats = drawn().frames(Q)[:, -1]
OWN: Floats = np.eye(4)
TABLE: Floats = np.eye(4)
TABLE[:3, :3] = Rotation.from_euler("ZYX", [25.0, -4.0, 8.0], degrees=True).as_matrix()
TABLE[:3, 3] = (0.3, -0.2, 0.1)
CLOSE_M = {".ls": 5e-5}  # that rounding of the literals may cost, of the others FINE_M
FINE_M = 2e-6


@dataclass(frozen=True)
class Form:
    """A program in a form that others write: `source`; `reached`: postures whose targets are corrected, in the order of
    the text; `left`: lines of what stays, each with a part of its reason; `kept`: how many joint targets stay.
    """

    source: str
    text: str
    reached: tuple[int, ...] = ()
    left: dict[int, str] = field(default_factory=lambda: {})
    kept: int = 0
    frame: Floats | None = None
    near: bool = False  # whether the program states the posture of each target


def corrected(text: str, suffix: str, frame: Floats | None = None, joint_targets: bool = False) -> CorrectedProgram:
    dialect = dialect_of(suffix)
    assert dialect is not None
    options = Options(tool=OWN, joint_targets=joint_targets)
    return correct_program(model(), text, dialect, frame, Q[0], {}, inverse(), options, "weld" + suffix)


@cache
def held_motion() -> Floats:
    """(4, 4) between the real flange and the wanted one that no measurement of a point on it determines."""
    done = corrected("".join(f"movel({ur(i)})\n" for i in range(3)), ".script")
    return np.linalg.inv(real().frames(done.found.q_rad)[0, -1]) @ T[0]


def assert_form(form: Form, suffix: str) -> None:
    """Targets that are corrected bring the real arm to their poses; each of the others is listed with its reason."""
    done = corrected(form.text, suffix, form.frame)
    found = {int(s.split(":")[0].split()[1]): s for s in done.skipped if s.startswith("line ")}
    assert sorted(found) == sorted(form.left), done.skipped
    assert len(done.skipped) == len(form.left), done.skipped
    for line, reason in form.left.items():
        assert reason in found[line]
    assert len(done.kept) == form.kept
    wanted = T[list(form.reached)]
    assert np.allclose(drawn().frames(done.found.nominal_rad)[:, -1], wanted, atol=5e-5)
    if form.near:
        assert np.allclose(done.found.nominal_rad, Q[list(form.reached)], atol=1e-4)
    off = np.linalg.inv(real().frames(done.found.q_rad)[:, -1]) @ wanted
    assert np.max(np.abs(off - held_motion())) < CLOSE_M.get(suffix, FINE_M)
    assert np.max(done.found.before.error_m) > 1e-4
    was, new = form.text.splitlines(), done.text.splitlines()
    changed = [k for k, pair in enumerate(zip(was, new, strict=True), start=1) if pair[0] != pair[1]]
    assert changed
    assert not set(changed) & set(form.left)


def mm(place: Floats) -> list[str]:
    return [f"{1e3 * v:.4f}" for v in place[:3, 3]]


def kuka(i: int, frame: Floats = OWN, more: str = "") -> str:
    """An aggregate without its braces."""
    place = inverse_of(frame) @ T[i]
    angles = Rotation.from_matrix(place[:3, :3]).as_euler("ZYX", degrees=True)
    return (
        ",".join(f"{k} {v}" for k, v in zip("XYZABC", [*mm(place), *(f"{a:.6f}" for a in angles)], strict=True)) + more
    )


def turns(i: int) -> str:
    return f",S 2,T {sum(1 << j for j in range(6) if Q[i, j] < 0.0)}"


def frame_of(place: Floats) -> str:
    """Of KRL."""
    angles = Rotation.from_matrix(place[:3, :3]).as_euler("ZYX", degrees=True)
    return ",".join(f"{k} {v:.9f}" for k, v in zip("XYZABC", [*(1e3 * place[:3, 3]), *angles], strict=True))


def rapid_pose(place: Floats) -> str:
    x, y, z, w = Rotation.from_matrix(place[:3, :3]).as_quat()
    return f"[{','.join(f'{1e3 * v:.5f}' for v in place[:3, 3])}],[{','.join(f'{v:.10f}' for v in (w, x, y, z))}]"


def abb(i: int, axes: str = "9E9,9E9,9E9,9E9,9E9,9E9", conf: str = "", frame: Floats = OWN) -> str:
    quarters = ",".join(str(int(np.floor(Q[i, j] / (np.pi / 2)))) for j in (0, 3, 5))
    return f"[{rapid_pose(inverse_of(frame) @ T[i])},[{conf or quarters + ',0'}],[{axes}]]"


def fanuc(i: int, frame: Floats = OWN) -> str:
    place = inverse_of(frame) @ T[i]
    r, p, w = Rotation.from_matrix(place[:3, :3]).as_euler("ZYX", degrees=True)
    lengths = ",\t".join(f"{k} = {v}  mm" for k, v in zip("XYZ", mm(place), strict=True))
    return f"{lengths},\n\tW = {w:.4f} deg,\tP = {p:.4f} deg,\tR = {r:.4f} deg"


def ur_pose(place: Floats) -> str:
    turn = Rotation.from_matrix(place[:3, :3]).as_rotvec()
    return "p[" + ", ".join(f"{v:.9f}" for v in [*place[:3, 3], *turn]) + "]"


def ur(i: int, frame: Floats = OWN) -> str:
    return ur_pose(inverse_of(frame) @ T[i])


def ur_joints(i: int) -> str:
    return "[" + ", ".join(f"{v:.7f}" for v in Q[i]) + "]"
