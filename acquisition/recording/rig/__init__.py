"""The rig file: what a person states about arm, tool, fixture, instruments and places, as frozen records.

`load_rig` reads a file, `parse_rig` its text; both check types, bounds and what must hold between keys, and name file,
line, key, value and remedy of the first fault. A new key is a field of its record in `schema` (in `devices` for what is
reached over a wire), and a rule in `rules` where it depends on other keys.
"""

from acquisition.recording.rig.read import load_rig, parse_rig, plain_rig, rig_sha256, rig_text
from acquisition.recording.rig.schema import Arm, ArmModel, Camera, Joint, Make, Placement, Pose, Rig, Sphere, Tolerance

__all__ = [
    "Arm",
    "ArmModel",
    "Camera",
    "Joint",
    "Make",
    "Placement",
    "Pose",
    "Rig",
    "Sphere",
    "Tolerance",
    "load_rig",
    "parse_rig",
    "plain_rig",
    "rig_sha256",
    "rig_text",
]
