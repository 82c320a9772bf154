"""The error of the tool, simulated before anything is built or measured.

Sources of `errors.toml` are drawn together; the share of each is stated.
"""

from calibrate.error_simulation.error_plan import NOTHING_STATED, read_error_plan, sources_of
from calibrate.error_simulation.machine import Machine, identified_machine, machine_of
from calibrate.error_simulation.monte_carlo import BINS
from calibrate.error_simulation.sensitivity import ROUNDING_M, Single
from calibrate.error_simulation.simulate import SHARE, Asked, Simulation, record_of, simulate, write_record

__all__ = [
    "BINS",
    "NOTHING_STATED",
    "ROUNDING_M",
    "SHARE",
    "Asked",
    "Machine",
    "Simulation",
    "Single",
    "identified_machine",
    "machine_of",
    "read_error_plan",
    "record_of",
    "simulate",
    "sources_of",
    "write_record",
]
