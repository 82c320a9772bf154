"""The arm of numpy_arm.py as an FMU, for trying fmu_arm.py without a tool that exports one.

pythonfmu build -f arm_as_fmu.py numpy_arm.py
"""

from numpy_arm import reflector_m
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Arm(Fmi2Slave):
    def __init__(self, **about):
        super().__init__(**about)
        self.q_rad, self.place_m = [0.0] * 6, [0.0] * 3
        for joint in range(6):
            self._variable(f"q{joint + 1}_rad", self.q_rad, joint, Fmi2Causality.input)
        for axis, name in enumerate("xyz"):
            self._variable(f"{name}_m", self.place_m, axis, Fmi2Causality.output)

    def do_step(self, current_time, step_size):
        self.place_m[:] = reflector_m(self.q_rad)
        return True

    def _variable(self, name, values, index, causality):
        get, put = lambda: values[index], lambda value: values.__setitem__(index, value)
        self.register_variable(Real(name, causality=causality, getter=get, setter=put))
