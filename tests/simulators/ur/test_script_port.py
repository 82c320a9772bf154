import contextlib
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.ur.script_program import KNOWN_CALLS, Call, PoseLiteral, ScriptRefused, read_lines
from simulators.ur.state_streams import ScriptWire
from simulators.ur.states import RuntimeState

START = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])


def send(bench, text: str) -> None:
    bench.controller.script_wire().handle(text.encode())


def test_a_bare_movej_moves_and_the_program_ends(bench) -> None:
    send(bench, f"movej({(START + 0.2).tolist()}, a=3.0, v=1.0)\n")
    assert bench.run_until(lambda: bench.controller.runner.state is RuntimeState.PLAYING, 1.0) < 0.1
    bench.run_until(lambda: bench.controller.runner.state is RuntimeState.STOPPED, 5.0)
    assert np.array_equal(bench.world.joints().q_rad, START + 0.2)


def test_a_program_of_lines_runs_in_order(bench) -> None:
    send(
        bench,
        f"def go():\n  set_tcp(p[0,0,0.1,0,0,0])\n  movej({(START + 0.1).tolist()})\n  sleep(0.2)\n"
        "  write_output_integer_register(0 + 24, 7)\nend\n",
    )
    bench.run(0.3)
    assert bench.controller.memory.outputs.ints[24] == 0
    bench.run(2.0)
    assert bench.controller.memory.outputs.ints[24] == 7
    assert np.array_equal(bench.world.joints().q_rad, START + 0.1)


def test_a_stopj_line_replaces_the_program_and_brakes(bench) -> None:
    send(bench, f"movej({(START + np.array([2.0, 0, 0, 0, 0, 0])).tolist()}, a=3.0, v=1.0)\n")
    bench.run(1.0)
    send(bench, "stopj(2.0)\n")
    bench.settle()
    assert bench.world.joints().q_rad[0] < 1.5


@pytest.mark.parametrize(
    "text",
    [
        "movec(p[0,0,0,0,0,0], p[0,0,0,0,0,0])\n",
        "def go():\n  while True:\n    sync()\n  end\nend\n",
        "movej([1,2,3])\n",
        "__import__('os')\n",
        "movej([1e999,0,0,0,0,0])\n",
        "sleep(" + "(" * 500 + "1" + ")" * 500 + ")\n",
    ],
)
def test_what_is_not_understood_is_refused_as_a_whole(bench, text: str) -> None:
    send(bench, text)
    bench.run(0.3)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    assert bench.controller.runner.last_error
    assert np.array_equal(bench.world.joints().q_rad, START)


def test_a_line_is_read_into_a_call() -> None:
    assert read_lines("movel(p[0.1,-0.2,0,0,0,0], a=1.2, v=0.25)") == (
        Call("movel", (PoseLiteral((0.1, -0.2, 0.0, 0.0, 0.0, 0.0)),), {"a": 1.2, "v": 0.25}),
    )


@given(st.text(max_size=80))
def test_any_text_is_a_call_or_refused(text: str) -> None:
    with contextlib.suppress(ScriptRefused):
        assert all(call.name in KNOWN_CALLS for call in read_lines(text))


@given(st.lists(st.integers(0, 60), max_size=5))
def test_a_program_arrives_whole_in_any_split(cuts: list[int]) -> None:
    text = b"textmsg(1)\ndef go():\n  sync()\nend\nstopj(2)\n"
    got: list[str] = []
    wire = ScriptWire(got.append)
    edges = [0, *sorted(cuts), len(text)]
    for start, end in itertools.pairwise(edges):
        wire.handle(text[start:end])
    assert got == ["textmsg(1)", "def go():\n  sync()\nend", "stopj(2)"]


def test_lines_set_outputs_load_and_gravity(bench) -> None:
    send(
        bench,
        "def set():\n  set_standard_digital_out(1, True)\n  set_configurable_digital_out(2, True)\n"
        "  set_tool_digital_out(0, True)\n  set_digital_out(3, True)\n  set_digital_out(3, False)\n"
        "  set_standard_analog_out(0, 0.25)\n  set_tool_voltage(24)\n  set_payload(1.5, [0.0, 0.01, 0.02])\n"
        "  set_gravity([0.0, 9.82, 0.0])\nend\n",
    )
    bench.run(0.2)
    memory = bench.controller.memory
    assert memory.digital_outputs == 1 << 1 | 1 << 10 | 1 << 16
    assert memory.analog_outputs == [2.5, 0.0]  # V
    assert memory.tool_voltage_v == 24
    assert memory.installation.payload_kg == 1.5
    assert memory.installation.payload_cog_m == (0.0, 0.01, 0.02)
    assert memory.installation.gravity_m_s2 == (0.0, 9.82, 0.0)


def test_the_force_sensor_is_zeroed_by_a_line(bench) -> None:
    assert bench.controller.rtde.readout.tool_wrench[2] < -3.0  # this bench states no payload
    send(bench, "zero_ftsensor()\n")
    bench.run(0.2)
    assert bench.controller.rtde.readout.tool_wrench == pytest.approx([0.0] * 6, abs=1e-12)


@pytest.mark.parametrize("line", ["set_tool_digital_out(2, True)", "set_payload(1.0, [0.0])", "set_gravity(9.82)"])
def test_a_line_with_an_impossible_number_ends_its_program(bench, line: str) -> None:
    send(bench, f"{line}\n")
    bench.run(0.2)
    assert line.partition("(")[0] in bench.controller.runner.last_error
    assert bench.controller.memory.digital_outputs == 0
