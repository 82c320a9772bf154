"""What model.json holds of the torques of the joints: links, rotors, and the effects beside them.

docs/formats.md explains every key.
"""

from typing import Annotated

from msgspec import Meta

from acquisition.recording.files.bounds import Count, Label, Many, Number, Sentence, Statistic
from calibrate.model.effect_records import EffectRecord, StrictRecord

Size = Annotated[float, Meta(ge=0.0, le=1e9)]
LinkNumbers = Annotated[tuple[Number, ...], Meta(min_length=10, max_length=10)]
NO_LINKS = "torques.links and torques.rotors_kg_m2 are of {} and {} joints; both hold one entry a joint"


class TorquesOfModel(StrictRecord, frozen=True):
    """What the joints of an arm take in motion; of a fit, or as a simulation states it.

    Of link i, which turns with joint i, mass (kg), first moments (kg m), and the tensor xx, yy, zz, xy, xz, yz (kg m²)
    about the origin of its frame B_i and in its axes: calibrate/model/arms/inverse_dynamics.py.
    """

    source: Label  # file that it was found in, or that states it
    links: Many[LinkNumbers]
    rotors_kg_m2: Many[Number]  # at the joint
    gravity_m_s2: tuple[Number, Number, Number]  # in the base
    effects: Many[EffectRecord] = ()
    middle_rad: Many[Number] = ()  # of each joint: what springs are counted from; of none: zero
    reference_degC: Many[Number] = ()  # of each joint: what friction by temperature is counted from
    noise_nm: Many[Statistic] = ()  # of each joint: one sigma; of none: not known
    moments: Count = 0
    triangle: Many[Many[Number]] = ()  # (row, link number) what the motion shows of the links, noise 1; of a fit
    notes: Many[Sentence] = ()

    def __post_init__(self) -> None:
        if len(self.links) != len(self.rotors_kg_m2):
            raise ValueError(NO_LINKS.format(len(self.links), len(self.rotors_kg_m2)))
