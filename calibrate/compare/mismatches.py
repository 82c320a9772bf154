"""What two recordings differ by, as a list, causes before constants: each with place, size, sigma, unit, one sentence.

First physics, then zeros of joints, links, zeros of encoders and the frames in which things stand; last the target on
the flange, which takes up what trades against the links. A measuring device that stands elsewhere, and the zeros of
second encoders, are set up again for every recording: they are stated with their size, and decide nothing.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from calibrate.compare.comparison_file import TARGET, Level, Mismatch, Side, in_words
from calibrate.compare.constants import LINK, ZERO
from calibrate.compare.corrected import Simulated
from calibrate.compare.fit_to_simulation import Constant, SimulationFit
from calibrate.diagnose.assess import Finding, named
from calibrate.diagnose.search import Bench, sizes_of
from calibrate.diagnose.state import Fitted
from calibrate.model.effects.moved import (
    RECORDING,
)
from calibrate.model.effects.term import Accepted, Size

Floats = NDArray[np.float64]

CLEAR = 5.0  # sigmas of an encoder's zero that is stated
LACKING = 0.25  # of an effect's size in the difference: less of it on one side is none
RANK = 1e-10  # of the largest singular value


LEVELS = {ZERO: Level.JOINT_ZEROS, LINK: Level.LINKS}  # all other constants are frames
PARTS = {
    TARGET: "The target on the flange",
    "laser-moved": "The laser on the flange",
    "fixture-moved": "The fixture",
    "seat-moved": "Seat",
    "psd-moved": "PSD 2 beside PSD 1",
    "device-moved": "The measuring device",
}


def mismatches(found: SimulationFit, zeros_rad: Floats) -> tuple[Mismatch, ...]:
    """`zeros_rad` (joint,): measured angles that are larger by a constant in all rows, taken out before."""
    out = [] if found.device is None else [_frame(found.device, decides=False)]
    out += [_of_constant(one, zeros_rad) for one in found.constants]
    encoders = _encoder_zeros(found)
    out += [] if encoders is None else [encoders]
    if found.diagnosed.physics is not None:
        said = found.diagnosed.physics.diagnosis
        out += [_of_finding(f, found, found.wide or found.diagnosed.physics.model) for f in said.findings]
        out += [
            Mismatch(Level.UNEXPLAINED, u.where, "unknown", {}, f"Something is left over{_at(u.where)}: {u.why}", p=u.p)
            for u in said.unexplained
        ]
    return tuple(out)


def _at(where: str) -> str:
    return f" at {where}" if where else ""


def _of_constant(one: Constant, zeros_rad: Floats) -> Mismatch:
    level = LEVELS.get(one.physics, Level.FRAMES)
    if level is Level.FRAMES:
        return _frame(one)
    (name,), (size,) = one.names, one.sizes
    owner, _, what = name.partition(".")
    if level is Level.JOINT_ZEROS:
        joint = owner.removeprefix("joint")
        size = Size(size.value - float(zeros_rad[int(joint) - 1]), size.sigma)
        key, says = "zero_rad", f"The zero of joint {joint} differs by"
    else:
        key = f"{what}_{'m' if what in ('length', 'offset') else 'rad'}"
        says = f"Link {owner.removeprefix('link')} differs: {what} by"
    sizes, says = {key: size}, f"{says} {in_words(key, size)}"
    return Mismatch(level, one.where, one.physics, sizes, says, p=one.p, alternatives=one.rivals, names=one.names)


def _frame(one: Constant, *, decides: bool = True) -> Mismatch:
    names = (
        one.names if one.physics == "device-moved" else tuple(f"{n.partition('.')[2]}_{_unit(n)}" for n in one.names)
    )
    sizes = dict(zip(names, one.sizes, strict=True))
    number = one.where.rpartition(" ")[2]
    what = f"{PARTS[one.physics]} {number}" if number.isdigit() else PARTS[one.physics]
    what = what.replace("The fixture ", "The fixture at station ").replace("on the flange ", "on the flange, number ")
    says = f"{what} stands elsewhere: {_six(sizes)}"
    parameters = () if one.physics == "device-moved" else one.names
    return Mismatch(
        Level.FRAMES, one.where, one.physics, sizes, says, decides, p=one.p, alternatives=one.rivals, names=parameters
    )


def _unit(name: str) -> str:
    return "m" if name.endswith((".x", ".y", ".z", "shift_u", "shift_v")) else "rad"


def _six(sizes: Mapping[str, Size]) -> str:
    """Lengths, then angles, each with its sigma."""
    lengths = [in_words(n, s) for n, s in sizes.items() if n.endswith("_m")]
    angles = [in_words(n, s) for n, s in sizes.items() if n.endswith("_rad")]
    parts = [f"moved by {', '.join(lengths)}"] if lengths else []
    return " and ".join(parts + ([f"turned by {', '.join(angles)}"] if angles else []))


def _encoder_zeros(found: SimulationFit) -> Mismatch | None:
    """Of all second encoders; None without any, or where none differs."""
    if found.diagnosed.physics is None:
        return None
    model, simulated = found.diagnosed.physics.model, found.simulated.values
    sizes: dict[str, Size] = {}
    for i, p in enumerate(model.session.parameters):
        if not p.name.startswith("encoder") or p.name not in simulated:
            continue
        apart = float((model.geometry[i] - simulated[p.name] + np.pi) % (2.0 * np.pi) - np.pi)
        sigma = float(np.sqrt(max(model.covariance[i, i], 0.0)))
        if abs(apart) > CLEAR * sigma:
            sizes[f"{p.name.partition('.')[0]}_rad"] = Size(apart, sigma)
    if not sizes:
        return None
    named_joints = ((n.removeprefix("encoder").removesuffix("_rad"), in_words(n, s)) for n, s in sizes.items())
    listed = ", ".join(f"joint {joint}: {words}" for joint, words in named_joints)
    says = f"The zeros of the second encoders are others, as they may be ({listed})"
    return Mismatch(Level.ENCODER_ZEROS, "encoders", "encoder-zero", sizes, says, decides=False)


def _of_finding(finding: Finding, found: SimulationFit, model: Fitted) -> Mismatch:
    """A constant that is no parameter of the model is a frame; what is left is physics. `model`: sizes are of this."""
    where, physics, rivals = finding.name.where, finding.name.physics, tuple(r.name for r in finding.rivals)
    sizes, says, accepted = finding.parameters, finding.says, None
    for i, one in enumerate(model.accepted):
        if named(one.term) == finding.name:
            accepted = one
            if says == one.term.says(sizes):  # of this term alone, and not of several that are one cause
                sizes = sizes_of(Bench(model), i)
                says = one.term.says(sizes)
    if finding.name.depends_on == (RECORDING,):
        level, says = LEVELS.get(physics, Level.FRAMES), says.replace("moved", "differs")
        return Mismatch(level, where, physics, sizes, says, p=finding.p, alternatives=rivals)
    side = Side.NEITHER if accepted is None else _side(accepted, found.simulated)
    if side is Side.SIMULATED and accepted is not None:
        says = f"Only the simulation has it: {physics} at {where}. {_of_the_other(accepted, sizes)}"
    says = f"{says}{SIDES[side]}"
    return Mismatch(Level.EFFECTS, where, physics, sizes, says, side=side, p=finding.p, alternatives=rivals)


def _of_the_other(accepted: Accepted, sizes: Mapping[str, Size]) -> str:
    """The effect as it is in the simulation: of the opposite sign."""
    m, k = len(accepted.coefficients), len(accepted.inner)
    there = accepted.term.sizes(-accepted.coefficients, np.zeros((m, m)), accepted.inner, np.zeros(k))
    return accepted.term.says({name: Size(one.value, sizes[name].sigma) for name, one in there.items()})


SIDES = {
    Side.NEITHER: "",
    Side.MEASURED: "; the simulation lacks it",
    Side.SIMULATED: "",
    Side.BOTH: " (measured less simulated); both have it, in another size",
}


def _side(accepted: Accepted, simulated: Simulated) -> Side:
    """By a fit of the same law, linear in its coefficients, to the simulated readings alone, geometry along with it."""
    if accepted.term.open:
        return Side.NEITHER
    rows = simulated.fitted.rows
    columns = simulated.fitted.columns(accepted.term, accepted.inner)
    difference = accepted.coefficients
    if columns.shape[1] != len(difference):  # directions of unknown masses are chosen by the poses
        return Side.NEITHER
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    solution = np.linalg.lstsq(np.hstack([columns / size, rows.geometry]), rows.residual, rcond=RANK)[0]
    there, whole = solution[: len(size)] / size, max(float(np.linalg.norm(difference)), 1e-300)
    if np.linalg.norm(there) < LACKING * whole:
        return Side.MEASURED
    return Side.SIMULATED if np.linalg.norm(there + difference) < LACKING * whole else Side.BOTH
