"""How a job can end when it is neither done nor lost."""


class PartialResult(Exception):  # noqa: N818 - it is a result
    """The job ended early, and what it had is kept; the message says where and how to go on. Exit code 3."""


class CheckFailed(Exception):  # noqa: N818 - a result of the check, not an error of it
    """Something that was checked is not as it should be; what, has been printed."""
