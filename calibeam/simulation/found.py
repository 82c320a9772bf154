"""One effect of a model with all that its mechanism is made from: sizes, port, and the session that it was found in."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.rig_in_numbers import arm_in_numbers, beyond_m, light_of
from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.curve import cause
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import likely_torque_nm
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.second_encoders import AGAINST, PLACES
from calibrate.model.effects.term import Accepted, Term
from calibrate.model.predict import Predictor
from simulators.arm.kinematics import Arm, forward, inverse
from simulators.arm.statics import Load, weigh
from simulators.conceal.rig import DualPsd

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FoundIn:
    """The session that effects are stated about, in the model's own geometry."""

    predictor: Predictor
    drivers: Drivers
    payload_com_m: Floats  # (3,) or (row, 3)

    @classmethod
    def of(cls, predictor: Predictor, drivers: Drivers) -> "FoundIn":
        """The geometry of `predictor`; conditions and readings as `drivers` has them."""
        com = drivers.payload_com_m
        return cls(predictor, drivers, np.zeros(3) if com is None else com)

    @property
    def start_s(self) -> float:
        """On the clock of the recording."""
        return float(self.drivers.t_s.min())

    @property
    def length_s(self) -> float:
        return max(float(np.ptp(self.drivers.t_s)), 1e-9)

    @cached_property
    def arm(self) -> Arm:
        return arm_in_numbers(self.predictor)

    @cached_property
    def beyond_m(self) -> Floats:
        """(n + 1,) see rig_in_numbers.py."""
        return beyond_m(self.predictor.rig)

    @cached_property
    def light(self) -> DualPsd:
        """DataError for a rig without a fixture."""
        found = light_of(self.predictor)
        if found is None:
            raise DataError(f"rig {self.predictor.rig.name}: an effect of the light, and no [fixture]")
        return found[0]

    @cached_property
    def middle_m(self) -> Floats:
        """(3,) of where the flange was: what drifts turns about it."""
        return self.drivers.frames[:, -1, :3, 3].mean(axis=0)

    @cached_property
    def load(self) -> Load:
        """What the weight of the arm as stated does at the session's samples."""
        frames = forward(self.arm, self.drivers.q_rad + self.arm.zero_rad)
        foot = np.broadcast_to(np.eye(4), (len(self.drivers.t_s), 4, 4))
        return weigh(self.arm, frames, foot, self.payload_kg, self.payload_com_m)

    @cached_property
    def payload_kg(self) -> Floats:
        """(row,)"""
        carried = self.drivers.payload_kg
        return np.zeros(len(self.drivers.t_s)) if carried is None else carried

    def own(self, pose: Floats, point_m: Floats) -> Floats:
        """(3,) a point of the base in a frame (4, 4)."""
        back = inverse(pose)
        return back[:3, :3] @ point_m + back[:3, 3]


@dataclass(frozen=True, eq=False)
class FoundEffect:
    """One effect with its values at the session."""

    name: str  # as in model.json
    term: Term
    coefficients: Floats
    inner: Floats
    session: FoundIn

    @classmethod
    def of(cls, effect: EffectRecord, accepted: Accepted, session: FoundIn) -> "FoundEffect":
        """As model.json holds it."""
        return cls(effect.name, accepted.term, accepted.coefficients, accepted.inner, session)

    @property
    def port(self) -> Port:
        return self.term.port

    @property
    def place(self) -> str:
        """Where it sits of a joint with two encoders, as in second_encoders.py; "" else."""
        ends = [place for place in PLACES if self.term.variant.endswith(place)]
        return max(ends, key=len, default="")  # one of them ends as another does

    @property
    def variant(self) -> str:
        """Without that place."""
        return self.term.variant.removesuffix(self.place).removesuffix(", ")

    @property
    def number(self) -> int:
        """Of its joint, link or detector, from 1; 0 for one that has none."""
        digits = "".join(c for c in self.term.port.where.split(".")[0] if c.isdigit())
        return int(digits) if digits else 0

    @property
    def driver(self) -> str:
        return self.term.depends_on[0]

    @cached_property
    def sizes(self) -> Mapping[str, float]:
        """Its parameters by name, as a person reads them."""
        m, k = len(self.coefficients), len(self.inner)
        sizes = self.term.sizes(self.coefficients, np.zeros((m, m)), self.inner, np.zeros(k))
        return {name: size.value for name, size in sizes.items()}

    @cached_property
    def amount(self) -> Floats:
        """(row, width) what it adds at its port over the session."""
        return self.term.amount(self.session.drivers, self.coefficients, self.inner)

    def turn_rad(self) -> Floats:
        """(row,) by which it turns its joint; of a drive on the other side of a second encoder, the drive itself."""
        if self.port.place is Place.JOINTS:
            return self.amount[:, self.number - 1]
        joints = self.session.drivers.readouts[self.port.instrument].joints
        return (-1.0 if self.place == AGAINST else 1.0) * self.amount[:, joints.index(self.number)]

    def size(self, *names: str) -> float:
        """The parameter of the first of these names that it has."""
        return next(self.sizes[name] for name in names if name in self.sizes)

    @property
    def at_s(self) -> float:
        """Its moment on the session's clock."""
        return self.size("time_s") - self.session.start_s

    @property
    def thermometer(self) -> str:
        """Where its temperature is taken; "" for what follows no temperature."""
        return self.driver.removeprefix("temp_") if self.driver.startswith("temp_") else ""

    @property
    def largest_nm(self) -> float:
        """Largest torque of weight about its joint over the session."""
        return float(np.abs(likely_torque_nm(self.session.drivers, self.number)).max())

    @property
    def other_joint(self) -> int:
        """Of its driver."""
        return int(self.driver.removeprefix("q"))

    def knots(self) -> Floats:
        """(row, d) its drivers over the session, side by side. KeyError for one that simulators cannot follow."""
        columns = [self._of(name) for name in ",".join(self.term.depends_on).split(",")]
        return np.concatenate([c if c.ndim == 2 else c[:, np.newaxis] for c in columns], axis=1)

    def _of(self, name: str) -> Floats:
        drivers, stem = self.session.drivers, name.rstrip("0123456789")
        if stem == "gravity_torque":
            return likely_torque_nm(drivers, int(name[len(stem) :]))
        if stem == "spot":
            k = int(name[len(stem) :])
            return np.nan_to_num(drivers.readouts[self.port.instrument].predicted[:, 2 * k - 2 : 2 * k])
        if name == "reading":
            return np.nan_to_num(drivers.readouts[self.port.instrument].predicted)
        if name == "t":
            return drivers.t_s - self.session.start_s
        if stem == "approach" and drivers.approach is not None:
            return drivers.approach[:, int(name[len(stem) :]) - 1]
        return cause(drivers, name)
