"""What can go wrong that is no fault of one device: in a session, and when a motion is not made."""


class AcquisitionError(Exception):
    """Base of acquisition's own errors; the message names what, where, value and remedy."""


class SpotLostError(AcquisitionError):
    """A pose could not be lit, or lost its light; the arm is back where there was some."""


class NoLightError(AcquisitionError):
    """No light could be found at all, or found again: the session cannot go on."""


class UnreachableError(AcquisitionError):
    """No joint position puts the beam where it was asked to be."""


class StoppedError(AcquisitionError):
    """A person stopped it; the arm is held, and what was recorded is kept."""


class TaskError(AcquisitionError):
    """The task's transforms do not determine a position, or contradict each other."""


class RefusedMotionError(UnreachableError):
    """The gate does not let a motion begin; the message names the segment and the joint or box.

    To a session it is a pose that cannot be had: it goes on with the next one.
    """


class InterruptedMotionError(AcquisitionError):
    """A motion under way was aborted, or could not be streamed in time; the arm has the stop command."""
