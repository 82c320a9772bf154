"""The curves of the live page in other programs: each opened by a client that is not ours."""

import base64
import json
import socket
import struct
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from acquisition.recording.mcap.layout import embedded_type
from calibeam.live.outlets import FoxgloveOutlet, LiveViews, OutletError, outlets
from drivers.device import Block

PATIENCE_S = 20.0
MESSAGE = struct.Struct("<BIQ")  # Foxglove WebSocket protocol v1, "Message Data": opcode 1, subscription, log time ns


def block(host_s: float, q_rad: list[float]) -> Block:
    t_s = np.array([host_s])
    values = {"actual_q_rad": np.array([q_rad]), "actual_qd_rad_s": np.zeros((1, len(q_rad)))}
    return Block(t_s, t_s, np.array([0]), values)


class Kept:
    def __init__(self) -> None:
        self.views: list[tuple[str, dict[str, float]]] = []

    def view(self, topic: str, kind: Any, values: Any) -> None:
        self.views.append((topic, dict(values)))


def test_curves_are_thinned_to_twenty_a_second_by_device() -> None:
    kept = Kept()
    views = LiveViews([kept], lambda: None)
    for k in range(64):
        views.heard("robot", block(k / 64, [0.1, 0.2]))
    assert len(kept.views) == 16  # every fourth sample in a second: three are less than 50 ms
    assert kept.views[0] == (
        "view/robot",
        {
            "host_s": 0.0,
            "actual_q_rad_1": 0.1,
            "actual_q_rad_2": 0.2,
            "actual_qd_rad_s_1": 0.0,
            "actual_qd_rad_s_2": 0.0,
        },
    )


def test_a_foxglove_client_reads_the_joints() -> None:
    with outlets(0, None, "cell") as (found, says):
        url = says[0].rsplit(" ", 1)[-1]
        views = LiveViews(found, lambda: None)
        views.heard("robot", block(1.0, [0.1, 0.2]))
        with connect(url, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as client:
            said: dict[str, Any] = {}
            while "advertise" not in said:
                message = json.loads(client.recv(PATIENCE_S))
                said[message["op"]] = message
            assert said["serverInfo"]["name"] == "cell"
            (channel,) = said["advertise"]["channels"]
            assert (channel["topic"], channel["encoding"]) == ("view/robot", "protobuf")
            subscribe = {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]}
            client.send(json.dumps(subscribe))
            data, second = None, 2.0
            while not isinstance(data, bytes):  # until the subscription has come to the server
                views.heard("robot", block(second, [0.3, -0.4]))
                second += 1.0
                try:
                    data = client.recv(0.1)
                except TimeoutError:
                    assert second < PATIENCE_S / 0.1
    opcode, subscription, log_ns = MESSAGE.unpack_from(data)
    assert (opcode, subscription) == (1, 7)
    kind = embedded_type(channel["schemaName"], base64.b64decode(channel["schema"] + "=="))
    view: Any = kind.new.FromString(data[MESSAGE.size :])
    assert (view.actual_q_rad_1, view.actual_q_rad_2) == (0.3, -0.4)
    assert log_ns == round(view.host_s * 1e9)


def test_plotjuggler_hears_json_with_its_time() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(PATIENCE_S)
        with outlets(None, listener.getsockname()[1], "cell") as (found, _):
            LiveViews(found, lambda: None).heard("robot", block(1.5, [0.1, float("nan")]))
            heard = json.loads(listener.recv(65536))
    assert heard["timestamp"] == 1.5
    assert heard["view/robot"]["actual_q_rad_1"] == 0.1
    assert "actual_q_rad_2" not in heard["view/robot"]  # a joint that does not answer is no curve


def test_a_port_that_is_taken_is_one_sentence() -> None:
    first = FoxgloveOutlet(0, "cell")
    try:
        with pytest.raises(OutletError, match="another program has this port"):
            FoxgloveOutlet(int(first.url.rsplit(":", 1)[-1]), "cell")
    finally:
        first.close()
