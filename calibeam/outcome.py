"""How a job can end when it is neither done nor lost."""


class PartialResult(Exception):  # noqa: N818 - it is a result
    """The job ended early, and what it had is kept; the message says where and how to go on. Exit code 3."""


class CheckFailed(Exception):  # noqa: N818 - a result of the check, not an error of it
    """Something that was checked is not as it should be; what, has been printed."""


def interruption(why: KeyboardInterrupt) -> str:
    """What the user or the system did: Ctrl-C, or the signal that calibeam.cli turns into the same exception."""
    return str(why.args[0]) if why.args else "Ctrl-C"
