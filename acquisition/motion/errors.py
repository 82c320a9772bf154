"""Why a motion is not made: the task does not say where, the arm cannot, or the cell does not allow it."""

from acquisition.errors import AcquisitionError, UnreachableError


class TaskError(AcquisitionError):
    """The task's transforms do not determine a position, or contradict each other."""


class RefusedMotionError(UnreachableError):
    """The gate does not let a motion begin; the message names the segment and the joint or box.

    To a session it is a pose that cannot be had: it goes on with the next one.
    """


class InterruptedMotionError(AcquisitionError):
    """A motion under way was aborted, or could not be streamed in time; the arm was told to stop."""
