"""Torques that a model expects of a recorded motion."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.diagnose.motion.known_torques import listed_torques
from calibrate.diagnose.motion.links_alone import motion_drivers
from calibrate.diagnose.motion.motion_table import Motion
from calibrate.diagnose.motion.torque_state import with_torque
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]


def links_of(known: TorquesOfModel) -> Floats:
    """(link number,) ten a link, then the rotors."""
    return np.array([*(number for link in known.links for number in link), *known.rotors_kg_m2])


def expected_nm(rig: Rig, motion: Motion, known: TorquesOfModel) -> Floats:
    """(moment, joint)"""
    drivers, links = motion_drivers(rig, motion, known), links_of(known)
    given = listed_torques(known.effects, drivers)
    drivers = with_torque(drivers, links, given)
    out = (drivers.link_columns @ links).reshape(motion.q_rad.shape)
    return np.asarray(sum((one.at(drivers) for one in given), out))
