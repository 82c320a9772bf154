"""What can be physically wrong with an arm and its instruments, as mechanisms that are exact and know nothing of a fit.

A file holds the mechanisms of one place: encoder, drive, torque, link, base, tool, fixture, detector, tracker,
and `outside` for what no catalogue lists. A new mechanism is one class there, with the method of its place (`defect.py`
lists the places), and one line in `mechanisms.MECHANISMS`, or in `mechanisms.GIVEN` where it has its numbers from a
model only.
"""

from simulators.defects.defect import Defect
from simulators.defects.mechanisms import GIVEN, MECHANISMS, RAISED, WrittenError, defects_of, written
from simulators.defects.scene import Light, Scene, Site, UnsuitedError

__all__ = [
    "GIVEN",
    "MECHANISMS",
    "RAISED",
    "Defect",
    "Light",
    "Scene",
    "Site",
    "UnsuitedError",
    "WrittenError",
    "defects_of",
    "written",
]
