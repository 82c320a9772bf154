"""Torques of a recorded motion beside those of a simulation: what they differ by, and what the simulation leaves out.

The simulation is a description of torques (calibrate/model/torque_records.py), taken along the measured motion: no
motion of its own has to be matched.
"""

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.compare.comparison_file import (
    ComparedJoint,
    ComparedTorques,
    ComparisonFile,
    Level,
    Mismatch,
    Side,
    difference_record,
)
from calibrate.compare.mismatches import LACKING, SIDES
from calibrate.diagnose.assess import Finding, Verdict
from calibrate.diagnose.motion import TorqueDiagnosis
from calibrate.diagnose.stages import DECIDING
from calibrate.model.effects.term import Size
from calibrate.model.effects.torque import masses_and_springs
from calibrate.model.parameters import start_values
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

LINKS = "links"  # place of what several links could hold
NO_SAMPLES = "Samples were not compared: give a recording of the simulation, --simulator or --simulated-model, too."


def torques_compared(
    measured: Recording, known: TorquesOfModel, found: TorqueDiagnosis, software: str, samples: ComparisonFile | None
) -> ComparisonFile:
    """The comparison of `samples`, where one was made, with that of the torques. `found`: beside what is `known`."""
    file = _nothing(measured, known, software) if samples is None else samples
    differ = [*(_of_finding(one, known) for one in found.diagnosis.findings), *_of_links(found, known.source)]
    left = [
        Mismatch(Level.UNEXPLAINED, u.where, "unknown", {}, f"Torque is left over at {u.where}: {u.why}", p=u.p)
        for u in found.diagnosis.unexplained
    ]
    records = [*file.differences, *(difference_record(one, None) for one in (*differ, *left))]
    levels = [level.value for level in Level]
    records.sort(key=lambda one: levels.index(one.level))
    failed = any(one.stage in DECIDING for one in found.diagnosis.incomplete)
    own = Verdict.MISMATCH if differ else Verdict.UNDECIDABLE if left or failed else Verdict.CONSISTENT
    says = _says(own, len(differ), known.source)
    return structs.replace(
        file,
        verdict=own.value if samples is None else _worse(samples.verdict, own.value),
        says=says if samples is None else f"{samples.says} {says}",
        differences=tuple(records),
        notes=(*file.notes, *known.notes),
        torques=ComparedTorques(known.source, found.motion.made, _joints(found)),
    )


def _nothing(measured: Recording, known: TorquesOfModel, software: str) -> ComparisonFile:
    notes = (NO_SAMPLES,) if len(measured.samples) else ()
    return ComparisonFile(
        1,
        "calibeam-comparison",
        software,
        measured.path.name,
        known.source,
        matched=0,
        only_measured_t_s=(),
        only_simulated_t_s=(),
        verdict=Verdict.UNDECIDABLE.value,
        says="",
        rig=(),
        differences=(),
        dropped=(),
        readings=(),
        first_link=None,
        links=(),
        streams=(),
        notes=notes,
        diagnosis=None,
    )


def _worse(one: str, two: str) -> str:
    order = (Verdict.MISMATCH.value, Verdict.UNDECIDABLE.value, Verdict.CONSISTENT.value)
    return min(one, two, key=order.index)


def _says(verdict: Verdict, count: int, source: str) -> str:
    if verdict is Verdict.MISMATCH:
        many = f"{count} differences" if count > 1 else "1 difference"
        return f"The torques measured and those of {source} differ: {many}."
    if verdict is Verdict.UNDECIDABLE:
        return f"The torques measured hold something beside those of {source} that has no name."
    return f"The torques measured and those of {source} agree to within the noise."


def _of_finding(finding: Finding, known: TorquesOfModel) -> Mismatch:
    where, physics, sizes = finding.name.where, finding.name.physics, finding.parameters
    side = _side(finding, known)
    only = f"Only the simulation has it: {physics} at {where}. " if side is Side.SIMULATED else ""
    rivals = tuple(one.name for one in finding.rivals)
    says = f"{only}{finding.says}{SIDES[side]}"
    return Mismatch(Level.EFFECTS, where, physics, sizes, says, side=side, p=finding.p, alternatives=rivals)


def _side(finding: Finding, known: TorquesOfModel) -> Side:
    """By the size that the simulation states; of a cause that it cannot state the simulation has none."""
    where, physics = finding.name.where, finding.name.physics
    if physics == masses_and_springs.ROTOR.physics:
        stated = known.rotors_kg_m2[int(where.removeprefix("joint").partition(".")[0]) - 1]
    elif physics == masses_and_springs.GRAVITY.physics:
        return Side.NEITHER
    else:
        own = [one for one in known.effects if (one.where, one.physics) == (where, physics)]
        stated = next((value for one in own for value in one.coefficients.values()), 0.0)
    more = next(iter(finding.parameters.values())).value
    if abs(stated) < LACKING * abs(more):
        return Side.MEASURED
    return Side.SIMULATED if abs(stated + more) < LACKING * abs(more) else Side.BOTH


def _of_links(found: TorqueDiagnosis, source: str) -> list[Mismatch]:
    """One line where fitted numbers of links and rotors change the torque of a joint by more than its noise."""
    model = found.model
    change = model.problem.columns @ (model.links - model.problem.links.stated)
    sizes = [_rms(change[model.problem.joint == j]) for j in range(len(model.problem.sigma_nm))]
    j = int(np.argmax(sizes / model.problem.sigma_nm))
    if sizes[j] <= model.problem.sigma_nm[j]:
        return []
    says = (
        f"Masses, centres, inertias or rotors differ from those of {source}: {sizes[j]:.2g} Nm rms at joint "
        f"{j + 1}; which number of which link is not determined, because only combinations of them act on the joints"
    )
    return [Mismatch(Level.EFFECTS, LINKS, "link-mass", {"torque_nm": Size(sizes[j], float("nan"))}, says)]


def _joints(found: TorqueDiagnosis) -> tuple[ComparedJoint, ...]:
    whole, model = found.bare.whole, found.model
    apart = -whole.misfit_nm(start_values(whole.parameters))  # before any number of a link is fitted
    left = model.problem.misfit_nm(model.theta)
    out, noise = list[ComparedJoint](), model.noise_nm
    for j in range(found.motion.torque_nm.shape[1]):
        rows, after = whole.joint == j, left[model.problem.joint == j]
        if not np.any(rows):
            continue
        measured = whole.observed_nm[rows]
        sizes = (_rms(each) for each in (measured, measured - apart[rows], apart[rows], after))
        out.append(ComparedJoint(j + 1, int(np.sum(rows)), *sizes, noise_nm=float(noise[j])))
    return tuple(out)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
