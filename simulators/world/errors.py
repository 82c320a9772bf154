"""What the emulated world refuses: a rig it cannot build, an unknown place, a set-point without sense."""


class WorldError(ValueError):
    """The message names the thing, the value and the remedy."""
