"""What can go wrong in a session that is not the fault of one device."""


class AcquisitionError(Exception):
    """Base of acquisition's own errors; the message names what, where, value and remedy."""


class SpotLostError(AcquisitionError):
    """A pose could not be lit, or lost its light; the arm is back where there was some."""


class NoLightError(AcquisitionError):
    """No light could be found at all, or found again: the session cannot go on."""


class UnreachableError(AcquisitionError):
    """No joint position puts the beam where it was asked to be."""


class StoppedError(AcquisitionError):
    """A person said stop; the arm is held, and what was recorded is kept."""
