"""`calibeam live` on emulated devices: it shows them, and its STOP ends what somebody else moves."""

import json
import threading
from collections.abc import Iterator
from http.client import HTTPConnection

import numpy as np
import pytest
from msgspec import structs
from websockets.sync.client import connect

from acquisition.recording.rig import Rig
from calibeam.devices.robot import robot_of
from calibeam.devices.site import addresses_of
from calibeam.emulation import Emulation
from calibeam.live.devices import devices_of, reading
from calibeam.live.page import LivePage, PageAddress, live_page
from drivers.clock import SystemClock
from drivers.errors import DeviceError


@pytest.fixture
def emulated(rig: Rig, emulation: Emulation) -> Rig:
    """The shipped rig with its devices where the emulators are."""
    where = addresses_of(rig, emulation.address)
    devices = structs.replace(rig.devices, psd=where.instrument, robot=where.robot, encoders=where.encoders)
    return structs.replace(rig, devices=devices)


@pytest.fixture
def page(emulated: Rig) -> Iterator[LivePage]:
    clock = SystemClock()
    with (
        live_page(emulated, clock, PageAddress(port=0), "watch") as page,
        reading(devices_of(emulated, clock, page.feed), page.feed),
    ):
        yield page


def test_it_shows_all_devices_and_its_stop_ends_a_motion(page: LivePage, emulated: Rig) -> None:
    host = page.url.removeprefix("http://").strip("/")
    robot = emulated.devices.robot
    assert robot is not None
    arm = robot_of(robot, SystemClock(), hurry=8.0).arm()
    arm.connect()
    ended: list[DeviceError] = []

    def move() -> None:
        try:
            while True:
                for far in (0.5, -0.5):
                    arm.move_joints(np.array([far, -1.4, 1.6, -0.5, 0.5, 0.0]), 0.3, 1.0)
        except DeviceError as why:
            ended.append(why)

    mover = threading.Thread(target=move)
    with connect(f"ws://{host}/feed", origin=f"http://{host}") as socket:  # pyright: ignore[reportArgumentType]
        moved: list[list[float]] = []
        states: dict[str, str] = {}
        mover.start()
        while set(states.values()) != {"live"} or len(states) < 3 or len(moved) < 2 or moved[0] == moved[-1]:
            message = json.loads(socket.recv(timeout=20.0))
            socket.send("1")
            if message["kind"] == "state":
                states = {device["device"]: device["state"] for device in message["devices"]}
            elif message["kind"] == "now" and message["q_rad"] is not None and message["faces"] is not None:
                moved.append(message["q_rad"])
    line = HTTPConnection(host, timeout=20.0)
    line.request("POST", "/stop", headers={"Origin": f"http://{host}"})
    assert json.loads(line.getresponse().read())["delivered"] is True
    line.close()
    mover.join(20.0)
    assert ended
    arm.close()
