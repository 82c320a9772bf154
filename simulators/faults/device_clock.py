"""The clock of a device, which in a healthy device is the world's."""

from collections.abc import Hashable


class DeviceClock:
    """What a device puts into its time stamps. Emulated time goes in, and is not touched itself.

    Several disturbances add up; each is mended by itself.
    """

    def __init__(self) -> None:
        self._wrong: dict[Hashable, tuple[float, float, float]] = {}  # whose -> step (s), drift, since when (s)

    def tells(self, t_s: float) -> float:
        """The stamp of something that happens at `t_s`, in seconds."""
        return t_s + sum(step_s + drift * (t_s - since_s) for step_s, drift, since_s in self._wrong.values())

    def disturb(self, whose: Hashable, step_s: float, drift: float, t_s: float) -> None:
        """From `t_s` on it is `step_s` farther ahead and gains `drift` more, seconds in a second."""
        self._wrong[whose] = step_s, drift, t_s

    def mend(self, whose: Hashable) -> None:
        """As if that one had not been."""
        self._wrong.pop(whose, None)
