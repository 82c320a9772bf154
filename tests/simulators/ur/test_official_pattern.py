"""What Universal Robots' own RTDE client does: negotiate, ask for documented fields, write inputs; many at once.

That client is no package of the index, so its requests are made here, and its way of reading: every package, in order.

Names and types are those of the RTDE guide's tables of controller outputs and inputs.
"""

import socket
import struct
from itertools import pairwise

import pytest

from tests.simulators.ur.conftest import emulator_process

DOUBLES = [
    "timestamp",
    "actual_execution_time",
    "target_execution_time",
    "speed_scaling",
    "target_speed_fraction",
    "actual_momentum",
    "actual_main_voltage",
    "actual_robot_voltage",
    "actual_robot_current",
    "io_current",
    "standard_analog_input0",
    "standard_analog_input1",
    "standard_analog_output0",
    "standard_analog_output1",
    "payload",
    "tcp_force_scalar",
    "tool_analog_input0",
    "tool_analog_input1",
    "tool_output_current",
    "tool_temperature",
    "joint_position_deviation_ratio",
    "collision_detection_ratio",
    "euromap67_24V_voltage",
    "euromap67_24V_current",
    "actual_robot_energy_consumed",
    "actual_robot_braking_energy_dissipated",
    "output_double_register_0",
    "output_double_register_47",
    "input_double_register_0",
]
SIXES = [
    "target_q",
    "target_qd",
    "target_qdd",
    "target_current",
    "target_moment",
    "actual_q",
    "actual_qd",
    "actual_current",
    "actual_current_window",
    "joint_control_output",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "target_TCP_pose",
    "target_TCP_speed",
    "tcp_offset",
    "joint_temperatures",
    "actual_joint_voltage",
    "ft_raw_wrench",
    "payload_inertia",
    "actual_current_as_torque",
    "actual_TCP_acceleration",
    "target_TCP_acceleration",
    "target_base_acceleration",
    "target_base_wrench",
    "wrench_calc_from_currents",
]
THREES = ["actual_tool_accelerometer", "elbow_position", "elbow_velocity", "payload_cog", "target_gravity"]
OTHERS = {
    "INT32": "robot_mode safety_mode safety_status tool_output_voltage encoder0_raw encoder1_raw "
    "time_scale_source "
    "output_int_register_0 output_int_register_47 input_int_register_24",
    "UINT32": "runtime_state robot_status_bits safety_status_bits analog_io_types tool_mode tool_analog_input_types "
    "script_control_line euromap67_input_bits euromap67_output_bits output_bit_registers0_to_31 "
    "output_bit_registers32_to_63",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits "
    "actual_configurable_digital_output_bits control_step",
    "BOOL": "output_bit_register_64 output_bit_register_127 input_bit_register_64",
    "UINT8": "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
    "VECTOR6INT32": "joint_mode",
}
DOCUMENTED = {
    **dict.fromkeys(DOUBLES, "DOUBLE"),
    **dict.fromkeys(SIXES, "VECTOR6D"),
    **dict.fromkeys(THREES, "VECTOR3D"),
    **{name: kind for kind, names in OTHERS.items() for name in names.split()},
}
SIZES = {
    "BOOL": 1, "UINT8": 1, "UINT32": 4, "UINT64": 8, "INT32": 4, "DOUBLE": 8, "VECTOR3D": 24, "VECTOR6D": 48,
    "VECTOR6INT32": 24,
}  # fmt: skip


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


class Client:
    """One connection of version 1 or 2, with the recipe it was given."""

    def __init__(self, bench, version: int, names: list[str], rate_hz: float = 500.0) -> None:
        self.wire, self.version = bench.controller.rtde.accept(), version
        assert self.wire.handle(frame("V", struct.pack(">H", version))) == frame("V", b"\1")
        rate = struct.pack(">d", rate_hz) if version == 2 else b""
        answer = self.wire.handle(frame("O", rate + ",".join(names).encode()))[3:]
        self.types = (answer[1:] if version == 2 else answer).decode().split(",")
        assert self.wire.handle(frame("S")) == frame("S", b"\1")

    @property
    def size(self) -> int:
        return 3 + (self.version == 2) + sum(SIZES[kind] for kind in self.types)


@pytest.mark.parametrize("version", [1, 2])
def test_every_documented_field_has_its_type_and_length(bench, version) -> None:
    client = Client(bench, version, list(DOCUMENTED))
    assert client.types == list(DOCUMENTED.values())
    bench.run(0.002)
    package = client.wire.due()
    assert len(package) == client.size
    assert struct.unpack_from(">HB", package) == (client.size, ord("U"))


@pytest.mark.parametrize("name", DOCUMENTED)
def test_each_field_can_be_asked_for_alone(bench, name) -> None:
    client = Client(bench, 2, [name])
    bench.run(0.002)
    assert len(client.wire.due()) == 4 + SIZES[DOCUMENTED[name]]


def test_clients_of_both_versions_and_several_rates_share_the_controller(bench) -> None:
    clients = [Client(bench, 1, ["timestamp"]), *(Client(bench, 2, ["timestamp"], hz) for hz in (500.0, 125.0, 10.0))]
    counts = [0] * len(clients)
    for _ in range(500):
        bench.run(0.002)
        for index, client in enumerate(clients):
            counts[index] += bool(client.wire.due())
    assert counts == [500, 500, 125, 10]


def test_an_input_belongs_to_one_client_until_it_goes(bench) -> None:
    first, second = (Client(bench, 2, ["timestamp"]) for _ in range(2))
    ask = frame("I", b"input_int_register_24")
    assert first.wire.handle(ask)[3:] == b"\1INT32"
    assert second.wire.handle(ask)[3:] == b"\0IN_USE"
    bench.controller.memory.release(first.wire)
    assert second.wire.handle(ask)[3:] == b"\1INT32"


def test_pause_and_start_again(bench) -> None:
    client = Client(bench, 2, ["timestamp"])
    assert client.wire.handle(frame("P")) == frame("P", b"\1")
    bench.run(0.002)
    assert client.wire.due() == b""
    client.wire.handle(frame("S"))
    bench.run(0.002)
    assert client.wire.due()


def received_cycles(host: str, count: int) -> list[int]:
    """Cycle numbers of as many data packages in a row, read over the wire as the official client reads them."""
    with socket.create_connection((host, 30004), 5.0) as line:
        stream = line.makefile("rwb")

        def answer() -> tuple[bytes, bytes]:
            size, kind = struct.unpack(">Hc", stream.read(3))
            return kind, stream.read(size - 3)

        for request in (
            frame("V", struct.pack(">H", 2)),
            frame("v"),
            frame("O", struct.pack(">d", 500.0) + b"timestamp,actual_q,actual_TCP_pose"),
            frame("S"),
        ):
            stream.write(request)
            stream.flush()
            kind, payload = answer()
            assert kind == request[2:3]
        assert payload == b"\1"
        cycles: list[int] = []
        while len(cycles) < count:
            kind, payload = answer()
            assert kind == b"U"
            cycles.append(round(struct.unpack_from(">d", payload, 1)[0] / 0.002))
        stream.write(frame("P"))
        stream.flush()
        while kind == b"U":  # what was on its way
            kind, payload = answer()
        assert (kind, payload) == (b"P", b"\1")
    return cycles


def gaps(cycles: list[int]) -> list[tuple[int, int]]:
    return [(before, after) for before, after in pairwise(cycles) if after - before != 1]


def test_a_thousand_packages_arrive_without_a_gap(emulated) -> None:
    assert gaps(received_cycles(emulated.host, 1000)) == []


@pytest.mark.endure
def test_ten_minutes_of_packages_arrive_without_a_gap() -> None:
    with emulator_process(time_scale=1.0) as where:
        assert gaps(received_cycles(where.host, 300_000)) == []
