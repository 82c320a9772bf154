"""What the live page shows as curves, sent on to people's own viewers: the views of a recording, while it happens.

Foxglove connects to a WebSocket server of the Foxglove SDK and gets protobuf messages; PlotJuggler's "UDP Server" gets
JSON. Topics and fields are those of a recording's `view/...`: a layout that fits the one fits the other.
Source: Foxglove SDK, "WebSocket server"; PlotJuggler 3, plugin "DataStreamUDP", message protocol "json", port 9870.
"""

import importlib
import json
import socket
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from math import isfinite
from typing import Any, Protocol

from acquisition.errors import AcquisitionError
from acquisition.recording.mcap.layout import VIEW_S, VIEW_TOPIC, MessageType, element_names, log_ns, packed, view_type
from acquisition.recording.samples import SPOTS
from acquisition.wires.psd_view import PsdView, psd_window
from calibeam.devices.site import VIEWED
from drivers.device import Block

LOOPBACK = "127.0.0.1"


class OutletError(AcquisitionError):
    """A viewer cannot be served."""


class Outlet(Protocol):
    """Takes one view at a time, from the reader thread of its device; returns at once."""

    def view(self, topic: str, kind: MessageType, values: Mapping[str, float]) -> None: ...


class LiveViews:
    """Thins what readers hear to VIEW_S for the outlets. `spots`: how currents become spots, once that is known."""

    def __init__(self, outlets: Sequence[Outlet], spots: Callable[[], PsdView | None]) -> None:
        self._outlets, self._spots = outlets, spots
        self._next_s: dict[str, float] = {}

    def heard(self, device: str, block: Block) -> None:
        """Of a block the newest sample, if the last view is long enough ago."""
        host_s = float(block.host_s[-1])
        if not self._outlets or host_s < self._next_s.get(device, float("-inf")):
            return
        self._next_s[device] = host_s + VIEW_S
        values = {"host_s": host_s}
        for name in VIEWED.get(device, ()):
            if name in block.values:
                newest = block.values[name][-1]
                names = element_names(name, newest.shape)
                values |= dict(zip(names, map(float, newest.reshape(-1)), strict=True))
        self._send(device, values)
        view = self._spots() if device == "psd" else None
        if view is not None:
            spots_m = view.each(psd_window([block])).mean(axis=0)  # as sessions record them
            self._send("spots", {"host_s": host_s} | dict(zip(SPOTS, map(float, spots_m), strict=True)))

    def _send(self, stream: str, values: dict[str, float]) -> None:
        kind = view_type(stream, tuple(values))
        for outlet in self._outlets:
            outlet.view(VIEW_TOPIC + stream, kind, values)


class FoxgloveOutlet:
    """A WebSocket server on this machine only. OutletError where the port is not to be had."""

    def __init__(self, port: int, name: str) -> None:
        self._sdk: Any = importlib.import_module("foxglove")
        self._context = self._sdk.Context()
        try:
            self._server = self._sdk.start_server(name=name, host=LOOPBACK, port=port, context=self._context)
        except (OSError, RuntimeError) as error:
            raise OutletError(f"--foxglove {port}: {error}; another program has this port, choose another") from error
        self._channels: dict[str, Any] = {}

    @property
    def url(self) -> str:
        return f"ws://{LOOPBACK}:{self._server.port}"

    def view(self, topic: str, kind: MessageType, values: Mapping[str, float]) -> None:
        channel = self._channels.get(topic)
        if channel is None:
            schema = self._sdk.Schema(name=kind.name, encoding="protobuf", data=kind.descriptor_set)
            channel = self._sdk.Channel(topic, message_encoding="protobuf", schema=schema, context=self._context)
            self._channels[topic] = channel
        channel.log(packed(kind, dict(values)), log_time=log_ns(values["host_s"]))

    def close(self) -> None:
        self._server.stop()


class PlotJugglerOutlet:
    """Datagrams to this machine; nobody needs to listen. `timestamp` is the field that PlotJuggler asks for."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._where = (LOOPBACK, port)

    def view(self, topic: str, kind: MessageType, values: Mapping[str, float]) -> None:
        curves = {name: value for name, value in values.items() if name != "host_s" and isfinite(value)}
        text = json.dumps({"timestamp": values["host_s"], topic: curves})
        try:
            self._socket.sendto(text.encode(), self._where)
        except OSError:
            return  # nobody listens yet, or its queue is full: the next one comes in 50 ms

    def close(self) -> None:
        self._socket.close()


@contextmanager
def outlets(foxglove: int | None, plotjuggler: int | None, name: str) -> Generator[tuple[list[Outlet], list[str]]]:
    """Those that are asked for, with a sentence each on how to open them. OutletError."""
    with ExitStack() as stack:
        found: list[Outlet] = []
        says: list[str] = []
        if foxglove is not None:
            server = FoxgloveOutlet(foxglove, name)
            stack.callback(server.close)
            found.append(server)
            says.append(f"Foxglove: open a connection to {server.url}")
        if plotjuggler is not None:
            sender = PlotJugglerOutlet(plotjuggler)
            stack.callback(sender.close)
            found.append(sender)
            says.append(f"PlotJuggler: start its UDP Server, port {plotjuggler}, json, timestamp from the field")
        yield found, says
