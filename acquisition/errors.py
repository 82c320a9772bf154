"""What can go wrong in a session that is not the fault of one device."""


class AcquisitionError(Exception):
    """Base of acquisition's own errors; the message names what, where, value and remedy."""


class SpotLostError(AcquisitionError):
    """No light could be found again."""


class UnreachableError(AcquisitionError):
    """No joint position puts the beam where it was asked to be."""
