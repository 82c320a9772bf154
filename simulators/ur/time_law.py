"""Trapezoidal time law: how far along a path at which time.

Source: Siciliano et al., "Robotics: Modelling, Planning and Control", section 4.2.1; the names `speed` and
`acceleration` are those of URScript's movej and movel (leading axis, tool).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Trapezoid:
    """From rest to rest over `distance` >= 0, in any unit u; u/s and u/s^2 are limits and stay under them."""

    distance: float
    acceleration: float
    ramp_s: float
    cruise_s: float

    @property
    def duration_s(self) -> float:
        return 2.0 * self.ramp_s + self.cruise_s

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Way, speed and acceleration at a time; still before the start and after the end."""
        if t_s >= self.duration_s:  # asked first: the shortest ways take no time at all
            return self.distance, 0.0, 0.0
        if t_s <= 0.0:
            return 0.0, 0.0, 0.0
        a, ramp = self.acceleration, self.ramp_s
        if t_s < ramp:
            return 0.5 * a * t_s * t_s, a * t_s, a
        if t_s <= ramp + self.cruise_s:
            return a * ramp * (t_s - 0.5 * ramp), a * ramp, 0.0
        left = self.duration_s - t_s
        return self.distance - 0.5 * a * left * left, a * left, -a


def trapezoid(distance: float, speed: float, acceleration: float) -> Trapezoid:
    """The fastest one within both limits. ValueError unless both are positive and the distance is not negative."""
    if not (distance >= 0.0 and speed > 0.0 and acceleration > 0.0):
        raise ValueError(
            f"move over {distance} at speed {speed} and acceleration {acceleration}; both must be positive"
        )
    ramp_s = min(speed / acceleration, (distance / acceleration) ** 0.5)
    cruise_s = max(0.0, distance / (acceleration * ramp_s) - ramp_s) if ramp_s > 0.0 else 0.0
    return Trapezoid(distance, acceleration, ramp_s, cruise_s)
