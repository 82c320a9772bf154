"""Faults as clients meet them, and the emulators as a library for other projects."""

import json
import os
import socket
import struct
import sys

import pytest
import serial

from drivers.psd_daq.codec import PsdDaqCodec
from drivers.psd_daq.messages import Identify
from simulators.process import EmulatorProcess, Emulators, EmulatorsError

VERSION_REQUEST = bytes.fromhex("000376")


def rtde(emulators) -> socket.socket:
    return socket.create_connection((emulators.address["robot"]["host"], 30004), 5.0)


def test_an_unplugged_serial_device_hangs_up_and_comes_back_under_its_name(emulators) -> None:
    name = emulators.address["psd"]["port"]
    with serial.Serial(name, timeout=5.0) as line:
        emulators.inject("psd", "disconnect", count=1)
        line.write(identify())
        with pytest.raises(OSError, match=r"device reports readiness|Input/output"):  # pyserial's words for a hang-up
            line.read(1000)
    emulators.clear()
    while not os.path.exists(name):
        emulators.ask("world.time")
    with serial.Serial(name, timeout=5.0) as line:
        line.write(identify())
        assert line.read(1)


def identify() -> bytes:
    return PsdDaqCodec().encode(Identify())


def test_a_tcp_client_is_dropped_and_may_come_back(emulators) -> None:
    with rtde(emulators) as client:
        emulators.inject("robot", "disconnect", count=1, port="rtde")
        client.sendall(VERSION_REQUEST)
        assert client.recv(100) == b""
    with rtde(emulators) as client:
        client.sendall(VERSION_REQUEST)
        assert client.recv(100)[2:3] == b"v"


def test_an_error_reply_in_the_words_of_the_protocol(emulators) -> None:
    with rtde(emulators) as client:
        emulators.inject("robot", "error", count=1)
        client.sendall(VERSION_REQUEST)
        _, kind, level = struct.unpack_from(">HBB", client.recv(100))
        assert (chr(kind), level) == ("M", 1)
        client.sendall(VERSION_REQUEST)
        assert client.recv(100)[2:3] == b"v"


def test_what_is_active_can_be_asked(emulators) -> None:
    emulators.inject("can", "silence", count=3)
    assert emulators.ask("fault.list") == [{"device": "can", "kind": "silence", "struck": 0, "left": 3}]
    emulators.clear("can")
    assert emulators.ask("fault.list") == []


def test_unknown_devices_and_kinds_are_named(emulators) -> None:
    with pytest.raises(EmulatorsError, match="no device 'laser'; there are psd, can, robot"):
        emulators.inject("laser", "silence")
    with pytest.raises(EmulatorsError, match="no fault 'silense'"):
        emulators.inject("psd", "silense")


def test_the_pytest_fixture_starts_a_rig_of_its_own(start_emulators, rig) -> None:
    only_psd = {**rig, "devices": {"psd": rig["devices"]["psd"]}}
    emulators = start_emulators(only_psd, seed=3)
    assert sorted(emulators.address) == ["control", "psd"]
    assert emulators.ask("world.time") >= 0.0


def test_what_a_child_says_on_stderr_is_read_while_it_runs() -> None:
    """Far more than a pipe holds: a child that nobody listens to would hang before its announcement."""
    code = (
        "import sys; [print('x' * 999, file=sys.stderr) for _ in range(1000)]; print('last', file=sys.stderr);"
        "print('{\"control\": {}}', flush=True); sys.stdin.read()"
    )
    with EmulatorProcess([sys.executable, "-c", code]) as process:
        assert process.address == {"control": {}}
    assert process.said.splitlines()[-1] == "last"
    assert len(process.said) < 100_000


def test_a_rig_that_cannot_be_emulated_says_why(rig) -> None:
    wrong = {**rig, "arm": {**rig["arm"], "model": "local_poe"}}
    with pytest.raises(EmulatorsError, match="the emulators did not start: rig"), Emulators(wrong):
        pass


def test_devices_do_not_listen_where_others_reach_them_unless_asked(rig) -> None:
    with pytest.raises(EmulatorsError, match=r"0\.0\.0\.0 can be reached from the network.*--expose"):
        Emulators(rig, robot_host="0.0.0.0", links=False).start()


def test_a_side_channel_beyond_loopback_wants_its_token(rig) -> None:
    only_psd = {**rig, "devices": {"psd": rig["devices"]["psd"]}}
    with Emulators(only_psd, links=False, control_host="0.0.0.0") as emulators:
        control = emulators.address["control"]
        assert emulators.ask("world.time") >= 0.0  # with the announced token
        for request in ({"do": "world.time"}, {"do": "world.time", "token": "guess"}):
            with socket.create_connection(("127.0.0.1", control["port"]), 5.0) as line:
                line.sendall(json.dumps(request).encode() + b"\n")
                answer = json.loads(line.makefile().readline())
            assert not answer["ok"]
            assert "token" in answer["error"]
