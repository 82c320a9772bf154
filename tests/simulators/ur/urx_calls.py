"""The session of urx 0.11.0: every public method.

It knows robot modes of 38 and 46 bytes; an e-Series controller sends 47, so that it never calls the robot running, and
no move waits for its end. What the emulated controller does not run (movep, movec, servoc, an unquoted text, `set sim`)
the client does not learn: the reason goes to port 30001.
"""

import math

from tests.simulators.ur.calls import (
    ARRIVED_RAD,
    HOME,
    NOW,
    TOOL_KG,
    ZEROS,
    Refused,
    Row,
    arrives,
    holds,
    near,
    numbers,
)

STOPPED = Refused("Robot stopped")
AHEAD = [0.1, *HOME[1:]]


def electric(joints) -> bool:
    """Voltage, current and temperature of every joint; of the board it reads places of an older firmware."""
    volts, amperes, degrees = ([joints[f"{what}{j}"] for j in range(6)] for what in ("V_actual", "I_actual", "T_motor"))
    return volts == [48.0] * 6 and all(map(math.isfinite, amperes)) and min(degrees) > 15.0


SECONDARY = [
    Row("secondary", "wait"),
    Row("secondary", "get_all_data", gives=lambda data: {"RobotModeData", "JointData", "CartesianInfo"} <= data.keys()),
    Row("secondary", "get_all_data", gives=lambda data: electric(data["JointData"])),
    Row("secondary", "get_cartesian_info", (True,), gives=lambda data: math.isfinite(data["X"])),
    Row(
        "secondary", "get_joint_data", (True,), gives=lambda data: data["V_actual0"] == 48.0 and data["T_motor0"] > 15.0
    ),
    Row("secondary", "get_digital_out", (0,), gives=0),
    Row("secondary", "get_digital_out_bits", gives=0),
    Row("secondary", "get_digital_in", (0,), gives=0),
    Row("secondary", "get_digital_in_bits", gives=0),
    Row("secondary", "get_analog_in", (0,), gives=near(0.0, 1e-9)),
    Row("secondary", "get_analog_inputs", gives=near([0.0, 0.0], 1e-9)),
    Row("secondary", "is_program_running", gives=False),
    Row("secondary", "send_program", (f"movej({HOME}, a=6, v=2)",)),
]
REALTIME = [
    Row("realtime", "wait"),
    arrives("realtime", "q_actual", HOME, ARRIVED_RAD, (True,)),
    Row("realtime", "getActual", (True,), gives=numbers(6)),
    Row("realtime", "q_target", (True,), gives=numbers(6)),
    Row("realtime", "getTarget", (True,), gives=numbers(6)),
    Row("realtime", "tcf_pose", (True,), gives=near(NOW.pose, 0.1)),
    Row("realtime", "getTCF", (True,), gives=numbers(6)),
    Row("realtime", "tcf_force", (True,), gives=near(ZEROS, 1e-9)),
    Row("realtime", "getTCFForce", (True,), gives=near(ZEROS, 1e-9)),
    Row("realtime", "get_all_data", gives=lambda data: data["ctrltimestamp"] > 0.0),
    Row("realtime", "start_buffering"),
    Row("realtime", "pop_buffer", gives=lambda item: len(item) == 4),
    Row("realtime", "try_pop_buffer", gives=lambda item: item is None or len(item) == 4),
    Row("realtime", "get_buffer", gives=lambda items: isinstance(items, list)),
    Row("realtime", "stop_buffering"),
    Row("realtime", "set_csys", ({"transform": ZEROS},)),
]
ROBOT = [
    Row("robot", "is_running", gives=False),
    Row("robot", "is_program_running", gives=lambda value: value in (True, False)),
    Row("robot", "getj", (True,), gives=near(HOME, 0.5)),
    Row("robot", "getl", (True,), gives=numbers(6)),
    Row("robot", "get_pose", gives=lambda value: value is not None),
    Row("robot", "get_pos", gives=numbers(3)),
    Row("robot", "get_orientation", gives=lambda value: value is not None),
    Row("robot", "get_tcp_force", gives=near(ZEROS, 1e-9)),
    Row("robot", "get_force", gives=near(0.0, 1e-9)),
    Row("robot", "get_realtime_monitor", gives=holds("URRTMonitor")),
    Row("robot", "get_analog_in", (0,), gives=near(0.0, 1e-9)),
    Row("robot", "get_analog_inputs", gives=near([0.0, 0.0], 1e-9)),
    Row("robot", "get_digital_in", (0,), gives=0),
    Row("robot", "get_digital_in_bits", gives=0),
    Row("robot", "get_digital_out", (0,), gives=0),
    Row("robot", "get_digital_out_bits", gives=0),
    *(Row("robot", name, gives=numbers_or_zero) for name in ("x", "y", "z") for numbers_or_zero in [math.isfinite]),
    *(Row("robot", name, gives=0) for name in ("rx", "ry", "rz", "x_t", "y_t", "z_t", "rx_t", "ry_t", "rz_t")),
    Row("robot", "send_program", ("set_standard_digital_out(2, True)",)),
    Row("robot", "send_message", ("hello",)),
    Row("robot", "set_tcp", (ZEROS,)),
    Row("robot", "set_payload", (TOOL_KG,)),
    Row("robot", "set_gravity", ([0.0, 0.0, 9.82],)),
    Row("robot", "set_digital_out", (3, True)),
    Row("robot", "set_analog_out", (0, 0.5)),
    Row("robot", "set_tool_voltage", (12,)),
    Row("robot", "set_simulation", (False,)),
    Row("robot", "set_freedrive", (False,)),
    Row("robot", "set_csys", ({"transform": ZEROS},)),
    Row("robot", "movej", (AHEAD, 6.0, 2.0, False)),
    Row("robot", "movej", (HOME, 6.0, 2.0), gives=STOPPED),
    *(Row("robot", name, (NOW.pose, 2.0, 0.5, False)) for name in ("movel", "movep", "servoc")),
    *(Row("robot", name, ([0.0, 0.0, 0.001, 0.0, 0.0, 0.0], 2.0, 0.5, False)) for name in ("movel_tool",)),
    Row("robot", "movec", (NOW.pose, NOW.pose, 2.0, 0.5, False)),
    Row("robot", "movels", ([NOW.pose, NOW.pose], 2.0, 0.5, 0.01, False)),
    Row("robot", "movex", ("movel", NOW.pose, 2.0, 0.5, False)),
    Row("robot", "movex_tool", ("movel", [0.0, 0.0, 0.001, 0.0, 0.0, 0.0], 2.0, 0.5, False)),
    Row("robot", "movexs", ("movel", [NOW.pose, NOW.pose], 2.0, 0.5, 0.01, False)),
    Row("robot", "set_pose", ({"transform": NOW.pose}, 2.0, 0.5, False)),
    Row("robot", "set_pos", (NOW.pose[:3], 2.0, 0.5, False)),
    Row("robot", "set_orientation", (NOW.pose[3:], 2.0, 0.5, False)),
    Row("robot", "add_pose_base", ({"transform": ZEROS}, 2.0, 0.5, False)),
    Row("robot", "add_pose_tool", ({"transform": ZEROS}, 2.0, 0.5, False)),
    Row("robot", "translate", ([0.0, 0.0, 0.001], 2.0, 0.5, False)),
    Row("robot", "translate_tool", ([0.0, 0.0, 0.001], 2.0, 0.5, False)),
    *(Row("robot", name, (0.001, 2.0, 0.5), gives=STOPPED) for name in ("up", "down", "back")),
    Row("robot", "speedj", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedl", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedl_tool", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedx", ("speedj", [0.01, *ZEROS[1:]], 2.0, 0.01)),
    *(Row("robot", name) for name in ("stopj", "stopl", "stop")),
    Row("robot", "new_csys_from_xpy", gives=Refused("EOFError")),  # asks the operator
    Row("realtime", "stop"),
    Row("realtime", "close"),
    Row("secondary", "close"),
    Row("robot", "close"),
]
URX = [*SECONDARY, *REALTIME, *ROBOT]
