"""Unmodified `canopen` and `python-can` against the emulated encoders, on a real pseudo-terminal and in process."""

import math
import queue
import threading
from collections.abc import Iterator

import can
import canopen
import pytest

from simulators.encoders.node import EncoderNode
from simulators.encoders.object_dictionary import EDS_PATH
from tests.simulators.encoders.virtual_bus import NodesOnBus

WAIT_S = 5.0
TURN = 1 << 20


@pytest.fixture
def network(served) -> Iterator[canopen.Network]:
    found = canopen.Network()
    found.NOTIFIER_CYCLE = 0.05  # how soon its thread ends; a second by default
    found.connect(interface="slcan", channel=served.channel, bitrate=1_000_000, sleep_after_open=0.05)
    yield found
    found.disconnect()


def test_the_shipped_eds_is_complete():
    dictionary = canopen.import_od(str(EDS_PATH), 5)
    assert dictionary[0x1000].default == 0x0002_0196
    assert dictionary[0x1801][1].default == 0x285
    assert dictionary["Position value"].pdo_mappable
    assert dictionary.device_information.nr_of_TXPDO == 2
    assert {1_000_000, 500_000, 250_000} <= dictionary.device_information.allowed_baudrates


def test_canopen_reads_every_object_of_the_dictionary(network):
    node = network.add_node(3, str(EDS_PATH))
    read = {}
    for index in node.object_dictionary:
        found = node.object_dictionary[index]
        subs = list(found) if not isinstance(found, canopen.objectdictionary.ODVariable) else [0]
        for sub in subs:
            read[index, sub] = node.sdo.upload(index, sub)
    assert len(read) > 60
    assert read[0x1008, 0] == b"Emulated CiA 406 multi-turn encoder"
    assert int.from_bytes(read[0x6501, 0], "little") == TURN
    assert node.sdo[0x1018]["Serial number"].raw == 0xCB0003
    assert node.sdo["Position value"].raw == 0


def test_canopen_writes_and_is_refused(network):
    node = network.add_node(1, str(EDS_PATH))
    node.sdo["Producer heartbeat time"].raw = 50
    assert node.sdo["Producer heartbeat time"].raw == 50
    assert node.nmt.wait_for_heartbeat(WAIT_S) == "PRE-OPERATIONAL"
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(0x6004, 0, bytes(4))
    assert refused.value.code == 0x06010002
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.upload(0x9999, 0)
    assert refused.value.code == 0x06020000


def test_canopen_gets_positions_on_sync(network):
    heard: queue.Queue[tuple[int, int]] = queue.Queue()
    for number in (1, 2, 6):
        node = network.add_node(number, str(EDS_PATH))
        node.tpdo.read()
        node.tpdo[2].add_callback(lambda pdo, number=number: heard.put((number, pdo["Position value"].raw)))
    network.nmt.state = "OPERATIONAL"
    network.sync.transmit()
    expected = {1: TURN // 4, 2: (1 << 32) - TURN // 4, 6: math.floor((10 + 0.5 / math.tau) * TURN)}
    assert dict(heard.get(timeout=WAIT_S) for _ in range(3)) == expected


def test_canopen_maps_another_pdo(network):
    heard: queue.Queue[list[int]] = queue.Queue()
    node = network.add_node(4, str(EDS_PATH))
    node.tpdo.read()
    pdo = node.tpdo[2]
    pdo.clear()
    pdo.add_variable("Alarms")
    pdo.add_variable("Position value")
    pdo.trans_type = 2
    pdo.save()
    pdo.add_callback(lambda found: heard.put([variable.raw for variable in found]))
    node.nmt.state = "OPERATIONAL"
    network.sync.transmit()
    network.sync.transmit()
    assert heard.get(timeout=WAIT_S) == [0, math.floor(TURN / math.tau)]


def test_canopen_sees_emergencies_and_restarts(network, served):
    node = network.add_node(2, str(EDS_PATH))
    node.sdo["Producer heartbeat time"].raw = 50
    node.nmt.wait_for_heartbeat(WAIT_S)
    served.verbs["encoders.emergency"](node=2, code=0x7320)
    emergency = node.emcy.wait(0x7320, WAIT_S)
    assert emergency is not None
    assert emergency.register == 0x21
    served.verbs["encoders.reset"](node=2)
    node.nmt.wait_for_bootup(WAIT_S)


def test_syncs_at_1_khz_lose_nothing(network):
    """Five SYNCs at once, as 1 kHz looks to a host that wakes every 5 ms: each of six nodes answers each of them."""
    heard: queue.Queue[int] = queue.Queue()
    for number in range(1, 7):
        network.subscribe(0x280 + number, lambda can_id, data, stamp: heard.put(can_id))
    network.nmt.state = "OPERATIONAL"
    for _ in range(40):
        for _ in range(5):
            network.sync.transmit()
        answers = [heard.get(timeout=WAIT_S) for _ in range(30)]
        assert sorted(answers) == sorted([*range(0x281, 0x287)] * 5)
    assert heard.empty()


def test_python_can_asks_the_adapter_who_it_is(served):
    with can.Bus(served.channel, interface="slcan", bitrate=1_000_000, sleep_after_open=0.05) as bus:
        assert bus.get_version(WAIT_S) == (10, 13)
        assert bus.get_serial_number(WAIT_S) == "CB01"


def test_the_same_nodes_in_process():
    """canopen on one end of python-can's virtual bus, the nodes pumped on the other by this test's own thread."""
    with can.Bus("encoders in process", interface="virtual") as there:
        nodes = NodesOnBus(there, [EncoderNode(1, lambda: 1.0)])
        done = threading.Event()

        def pump() -> None:
            while not done.is_set():
                nodes.pump(now_s=0.0, wait_s=0.05)

        pumping = threading.Thread(target=pump)
        pumping.start()
        network = canopen.Network()
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="virtual", channel="encoders in process")
        try:
            node = network.add_node(1, str(EDS_PATH))
            assert node.sdo["Position value"].raw == math.floor(TURN / math.tau)
            assert node.sdo["Manufacturer software version"].raw == "1.0.0"
        finally:
            network.disconnect()
            done.set()
            pumping.join()


def test_pumping_by_hand_needs_no_thread():
    with can.Bus("by hand", interface="virtual") as here, can.Bus("by hand", interface="virtual") as there:
        nodes = NodesOnBus(there, [EncoderNode(7, lambda: 0.0)])
        assert nodes.pump(now_s=0.0) == 0
        boot_up = here.recv(0.0)
        assert boot_up is not None
        assert (boot_up.arbitration_id, bytes(boot_up.data)) == (0x707, b"\0")
        here.send(can.Message(arbitration_id=0, data=[1, 7], is_extended_id=False))
        here.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert nodes.pump(now_s=0.0) == 2
        position = here.recv(0.0)
        assert position is not None
        assert (position.arbitration_id, bytes(position.data)) == (0x287, bytes(4))
