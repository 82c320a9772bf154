"""Which quantities a Modbus controller may have, and how few requests fetch those of a map."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from drivers.device import Channel, Floats
from drivers.modbus.register import HOLDING, INPUT, Register

MOST_READ = 125  # registers in one request (Modbus Application Protocol V1.1b3, section 6.3)
SIX = (6,)

READINGS = (
    Channel("actual_q_rad", "rad", SIX),
    Channel("actual_qd_rad_s", "rad/s", SIX),
    Channel("target_q_rad", "rad", SIX),
    Channel("actual_current_a", "A", SIX),
    Channel("joint_temperature_degC", "degC", SIX),
    Channel("robot_mode", "1"),
    Channel("safety_mode", "1"),
    Channel("protective_stopped", "1"),
    Channel("emergency_stopped", "1"),
    Channel("speed_scaling", "1"),
    Channel("payload_kg", "kg"),
    Channel("life", "1"),  # counts while the controller's program runs: the only way to see that values are fresh
)
JOINTS = "actual_q_rad"  # without these there is nothing to record
LIFE = "life"
# the handshake of docs/protocols/modbus.md: first what the host writes, then what the controller's program writes
COMMANDS = {
    "command_q_rad": 6,
    "command_speed_rad_s": 1,
    "command_acceleration_rad_s2": 1,
    "command_number": 1,
    "stop": 1,
    "host_life": 1,
}
ANSWERS = {"state": 1, "state_number": 1, "reason": 1}
COUNTS = {**{channel.name: (channel.shape or (1,))[0] for channel in READINGS}, **COMMANDS, **ANSWERS}


@dataclass(frozen=True)
class Request:
    """One read: `count` registers of a table from `address` on."""

    table: str
    address: int
    count: int


class RegisterMap:
    """The registers of one controller. ValueError for names, counts or places that cannot be."""

    def __init__(self, registers: Iterable[Register], read_across: int = 0) -> None:
        """`read_across`: so many registers that are not in the map may be read to save a request."""
        self.registers: Mapping[str, Register] = _by_name(tuple(registers))
        self._read_across = read_across
        if JOINTS not in self.registers:
            raise ValueError(f"the register map has no {JOINTS}; add it")

    @property
    def readings(self) -> tuple[Channel, ...]:
        """What can be recorded."""
        return tuple(channel for channel in READINGS if channel.name in self.registers)

    @property
    def missing_for_motion(self) -> tuple[str, ...]:
        """What a handshake would need and the map does not have."""
        return tuple(name for name in (*COMMANDS, *ANSWERS) if name not in self.registers)

    def requests(self, names: Sequence[str]) -> tuple[Request, ...]:
        """The fewest reads for these; what stands together is read together, so that it is of one moment."""
        spans = sorted((self.registers[name].table, *span) for name in names for span in self.registers[name].spans)
        joined: list[tuple[str, int, int]] = []
        for table, first, end in spans:
            if joined and joined[-1][0] == table:
                _, start, last = joined[-1]
                if first - last <= self._read_across and max(end, last) - start <= MOST_READ:
                    joined[-1] = (table, start, max(end, last))
                    continue
            joined.append((table, first, end))
        return tuple(Request(table, first, end - first) for table, first, end in joined)

    def decode(self, name: str, words: Mapping[tuple[str, int], int]) -> Floats:
        """SI values (count,) of raw registers by (table, address)."""
        register = self.registers[name]
        numbers, *turns = ([words[register.table, at] for at in range(*span)] for span in register.spans)
        return register.decode(numbers, *turns)


def _by_name(registers: tuple[Register, ...]) -> dict[str, Register]:
    found: dict[str, Register] = {}
    for register in registers:
        if register.name not in COUNTS:
            raise ValueError(f"register {register.name!r} is no known quantity; there are {', '.join(COUNTS)}")
        if register.name in found:
            raise ValueError(f"register {register.name} stands twice in the map; keep one")
        if register.count != COUNTS[register.name]:
            raise ValueError(f"register {register.name}: count {register.count}, it has {COUNTS[register.name]} values")
        if register.name in COMMANDS and register.table == INPUT:
            raise ValueError(f"register {register.name}: input registers cannot be written; put it into {HOLDING}")
        found[register.name] = register
    return found
