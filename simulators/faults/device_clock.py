"""The clock of a device, which in a healthy device is the world's."""


class DeviceClock:
    """What a device puts into its time stamps. Emulated time goes in, and is not touched itself."""

    def __init__(self) -> None:
        self.step_s = 0.0
        self.drift = 0.0  # seconds gained in a second
        self._drifts_from_s = 0.0

    def tells(self, t_s: float) -> float:
        """The stamp of something that happens at `t_s`, in seconds."""
        return t_s + self.step_s + self.drift * (t_s - self._drifts_from_s)

    def disturb(self, step_s: float, drift: float, t_s: float) -> None:
        """From `t_s` on it is `step_s` ahead and gains `drift`."""
        self.step_s, self.drift, self._drifts_from_s = step_s, drift, t_s

    def mend(self) -> None:
        """The world's time again."""
        self.disturb(0.0, 0.0, 0.0)
