"""The examples of docs/call-from-a-program.md run; ur_rtde and ROS are replaced by recorders of their calls."""

import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import drawn, model, real

PAGE = Path(__file__).parents[2] / "docs" / "call-from-a-program.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
NOW_RAD = [0.3, -0.4, 0.2, -0.5, 0.8, 0.1]
JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
ORDER = [2, 1, 0, 3, 4, 5]  # of the joints in messages of some drivers


class Control:
    """The arguments of RTDEControlInterface.moveJ, in their order, as its documentation names them."""

    def __init__(self, hostname):
        self.hostname = hostname
        self.moved = []
        Control.last = self

    def moveJ(self, q, speed=1.05, acceleration=1.4, asynchronous=False):
        assert all(type(angle) is float for angle in q)
        self.moved.append((q, speed, acceleration, asynchronous))

    def stopScript(self):
        self.moved.append("stopped")


class RosNode:
    """What a node of rclpy has, of what the example uses."""

    def __init__(self, name):
        self.name, self.sent, self.errors = name, [], []
        RosNode.last = self

    def create_publisher(self, kind, topic, depth):
        assert kind is Trajectory
        assert (topic, depth) == ("corrected_trajectory", 10)
        return SimpleNamespace(publish=self.sent.append)

    def create_subscription(self, kind, topic, callback, depth):
        assert kind is Trajectory
        assert (topic, depth) == ("planned_trajectory", 10)
        self.receive = callback

    def get_logger(self):
        return SimpleNamespace(error=self.errors.append)


class Trajectory(SimpleNamespace):
    """trajectory_msgs/msg/JointTrajectory."""


def module(name, **names):
    made = ModuleType(name)
    vars(made).update(names)
    return made


@pytest.fixture
def names(tmp_path, monkeypatch):
    """What stands after the first example."""
    receiver = SimpleNamespace(getActualQ=lambda: list(NOW_RAD))
    for made in (
        module("rtde_control", RTDEControlInterface=Control),
        module("rtde_receive", RTDEReceiveInterface=lambda hostname: receiver),
        module("rclpy", init=lambda: None, spin=lambda node: None),
        module("rclpy.node", Node=RosNode),
        module("trajectory_msgs"),
        module("trajectory_msgs.msg", JointTrajectory=Trajectory),
    ):
        monkeypatch.setitem(sys.modules, made.__name__, made)
    monkeypatch.chdir(tmp_path)
    write_model(tmp_path / "model.json", model())
    space = {}
    exec(compile(BLOCKS[0], str(PAGE), "exec"), space)
    return space


def run_block(number, names):
    exec(compile(BLOCKS[number], str(PAGE), "exec"), names)


def test_the_first_example_leads_back_to_its_joints(names):
    assert np.abs(names["same_rad"] - names["q_rad"]).max() < 1e-8


def test_a_ur_is_sent_where_its_real_tool_is_20_mm_higher(names):
    run_block(1, names)
    (q_rad, speed, acceleration, asynchronous), stopped = Control.last.moved
    assert (speed, acceleration, asynchronous, stopped) == (0.5, 0.5, False, "stopped")
    before, after = real().frames(np.array([NOW_RAD, q_rad]))[:, -1]
    assert np.allclose(after[:3, :3], before[:3, :3], atol=1e-9)
    assert np.allclose(after[:3, 3] - before[:3, 3], [0.0, 0.0, 0.02], atol=1e-9)


def test_the_ros_node_corrects_a_plan_from_its_start_on(names):
    run_block(2, names)
    q_rad = np.array([NOW_RAD, NOW_RAD, [0.4, -0.3, 0.1, -0.5, 0.9, 0.0]])
    seconds = [(0, 0), (0, 250_000_000), (1, 0)]
    points = [
        SimpleNamespace(positions=row[ORDER].tolist(), time_from_start=SimpleNamespace(sec=sec, nanosec=nanosec))
        for row, (sec, nanosec) in zip(q_rad, seconds, strict=True)
    ]
    node = RosNode.last
    node.receive(Trajectory(joint_names=[JOINTS[j] for j in ORDER], points=points))
    (plan,) = node.sent
    found_rad = np.array([point.positions for point in plan.points])[:, np.argsort(ORDER)]
    assert np.array_equal(found_rad[0], q_rad[0])
    goal, there = drawn().frames(q_rad[2:])[0, -1], real().frames(found_rad[2:])[0, -1]
    point_m = names["model"].forward(q_rad[2:], nominal=True)[0, :3, 3]
    in_goal_m = np.linalg.inv(goal) @ np.append(point_m, 1.0)
    assert np.linalg.norm((there @ in_goal_m)[:3] - point_m) < 1e-4  # the flange's mounting is estimated
    assert 1e-3 < np.abs(found_rad[2] - q_rad[2]).max() < 1e-2
    half = found_rad[1] - q_rad[1]
    whole = names["model"].inverse(names["model"].forward(q_rad[1], nominal=True), near_rad=q_rad[1])[0] - q_rad[1]
    assert np.allclose(half, 0.5 * whole, atol=1e-12)


def test_the_ros_node_sends_nothing_where_a_point_is_out_of_reach(names):
    run_block(2, names)
    far = drawn().upper_rad + 0.3
    point = SimpleNamespace(positions=far.tolist(), time_from_start=SimpleNamespace(sec=1, nanosec=0))
    node = RosNode.last
    node.receive(Trajectory(joint_names=JOINTS, points=[point]))
    assert node.sent == []
    assert "pose [0]" in node.errors[0]
