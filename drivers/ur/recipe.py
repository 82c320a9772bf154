"""What the recorder asks a controller for: RTDE names, and the names and units under which they are recorded.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", table of controller outputs (units: rad, rad/s, A,
degC, kg; states as numbers).
"""

from dataclasses import dataclass

from drivers.device import Channel


@dataclass(frozen=True)
class Variable:
    """One RTDE variable and its channel."""

    rtde_name: str
    channel: Channel


TIMESTAMP = "timestamp"  # s since the controller's start: the device clock, no channel
SIX = (6,)
VARIABLES = (
    Variable("target_q", Channel("target_q_rad", "rad", SIX)),
    Variable("actual_q", Channel("actual_q_rad", "rad", SIX)),
    Variable("actual_qd", Channel("actual_qd_rad_s", "rad/s", SIX)),
    Variable("actual_current", Channel("actual_current_a", "A", SIX)),
    Variable("joint_temperatures", Channel("joint_temperature_degC", "degC", SIX)),
    Variable("robot_mode", Channel("robot_mode", "1")),
    Variable("safety_mode", Channel("safety_mode", "1")),
    Variable("safety_status_bits", Channel("safety_status_bits", "1")),
    Variable("runtime_state", Channel("runtime_state", "1")),
    Variable("robot_status_bits", Channel("robot_status_bits", "1")),
    Variable("joint_mode", Channel("joint_mode", "1", SIX)),
    Variable("speed_scaling", Channel("speed_scaling", "1")),
    Variable("target_speed_fraction", Channel("speed_slider", "1")),
    Variable("actual_TCP_pose", Channel("actual_tcp_pose_m_rad", "m, rad", SIX)),
    Variable("tcp_offset", Channel("tcp_offset_m_rad", "m, rad", SIX)),  # from PolyScope 5.x on
    Variable("actual_digital_input_bits", Channel("digital_inputs", "1")),
    Variable("actual_digital_output_bits", Channel("digital_outputs", "1")),
    Variable("standard_analog_input0", Channel("analog_input0", "1")),  # V or A, as the installation says
    Variable("standard_analog_input1", Channel("analog_input1", "1")),
    Variable("payload", Channel("payload_kg", "kg")),  # from PolyScope 3.11 / 5.5.1 on
    Variable("payload_cog", Channel("payload_cog_m", "m", (3,))),
)
REQUIRED = (TIMESTAMP, "actual_q")  # without these there is nothing to record
NOT_FOUND = "NOT_FOUND"
