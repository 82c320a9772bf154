"""Which poses to measure: candidates within reach, what each would show, the smallest set that is enough."""

from calibrate.design.candidates import POSE_S, Candidates
from calibrate.design.design import Design, DesignOptions, design, record_of
from calibrate.design.information import Information, information_of, target_of, with_prior
from calibrate.design.places import Places, choose_places
from calibrate.design.seen import Seen, seen_by

__all__ = [
    "POSE_S",
    "Candidates",
    "Design",
    "DesignOptions",
    "Information",
    "Places",
    "Seen",
    "choose_places",
    "design",
    "information_of",
    "record_of",
    "seen_by",
    "target_of",
    "with_prior",
]
