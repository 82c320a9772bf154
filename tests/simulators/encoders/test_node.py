"""One encoder node, frame by frame, against the layouts of CiA 301 and CiA 406."""

import struct

import pytest

from simulators.encoders.bus import CanFrame
from simulators.encoders.node import EncoderNode, NmtState

NO_DATA = b""


def nmt(node: EncoderNode, command: int, number: int = 1, now_s: float = 0.0) -> list[CanFrame]:
    return node.handle(CanFrame(0x000, bytes((command, number))), now_s)


def sdo(node: EncoderNode, *request: int) -> bytes:
    """The 8 bytes that answer a request, padded to 8."""
    (answer,) = node.handle(CanFrame(0x601, bytes(request).ljust(8, b"\0")), 0.0)
    assert answer.id == 0x581
    return answer.data


def read(node: EncoderNode, index: int, subindex: int = 0) -> int:
    answer = sdo(node, 0x40, index & 0xFF, index >> 8, subindex)
    assert answer[0] & 0xE3 == 0x43, answer.hex(" ")
    return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")


def write(node: EncoderNode, index: int, subindex: int, value: int, size: int) -> int:
    """0 when done, else the abort code."""
    head = 0x23 | (4 - size) << 2
    answer = sdo(node, head, index & 0xFF, index >> 8, subindex, *value.to_bytes(size, "little"))
    return 0 if answer[0] == 0x60 else struct.unpack_from("<I", answer, 4)[0]


def sync(node: EncoderNode) -> list[CanFrame]:
    return node.handle(CanFrame(0x080), 0.0)


# --- network management


def test_power_on_is_a_boot_up_message_and_no_pdo():
    node = EncoderNode(5, lambda: 0.0)
    assert node.due(0.0) == [CanFrame(0x705, b"\0")]
    assert node.state is NmtState.PRE_OPERATIONAL
    assert sync(node) == []


@pytest.mark.parametrize(
    ("commands", "state"),
    [
        ([0x01], NmtState.OPERATIONAL),
        ([0x01, 0x02], NmtState.STOPPED),
        ([0x01, 0x80], NmtState.PRE_OPERATIONAL),
        ([0x02, 0x01], NmtState.OPERATIONAL),
        ([0x01, 0x81], NmtState.PRE_OPERATIONAL),
        ([0x01, 0x82], NmtState.PRE_OPERATIONAL),
        ([0x01, 0x77], NmtState.OPERATIONAL),
    ],
)
def test_network_commands(node, commands, state):
    for command in commands:
        nmt(node, command)
    assert node.state is state


def test_commands_reach_all_with_node_0_and_nobody_else_with_another(node):
    nmt(node, 0x01, number=2)
    assert node.state is NmtState.PRE_OPERATIONAL
    nmt(node, 0x01, number=0)
    assert node.state is NmtState.OPERATIONAL


def test_a_stopped_node_answers_no_sdo_and_no_sync(node):
    nmt(node, 0x02)
    assert node.handle(CanFrame(0x601, bytes((0x40, 0, 0x10, 0, 0, 0, 0, 0))), 0.0) == []
    assert sync(node) == []


def test_reset_says_boot_up(node):
    assert nmt(node, 0x81) == [CanFrame(0x701, b"\0")]


def test_heartbeat_at_its_period_with_the_state(node):
    assert write(node, 0x1017, 0, 100, 2) == 0
    frames = [(t, frame) for t in range(0, 501, 10) for frame in node.due(t * 1e-3)]
    assert [t for t, _ in frames] == [100, 200, 300, 400, 500]
    assert {frame for _, frame in frames} == {CanFrame(0x701, b"\x7f")}
    nmt(node, 0x01, now_s=0.5)
    assert node.due(0.61) == [CanFrame(0x701, b"\x05")]


# --- SDO


def test_the_documented_read_of_the_position(node):
    assert sdo(node, 0x40, 0x04, 0x60, 0x00) == bytes.fromhex("43 04 60 00 00 00 04 00")


def test_expedited_answers_state_their_size(node):
    assert sdo(node, 0x40, 0x01, 0x10, 0x00) == bytes.fromhex("4f 01 10 00 00 00 00 00")
    assert sdo(node, 0x40, 0x17, 0x10, 0x00) == bytes.fromhex("4b 17 10 00 00 00 00 00")
    assert read(node, 0x1000) == 0x0002_0196


def test_a_text_comes_in_segments_with_a_toggling_bit(node):
    head = sdo(node, 0x40, 0x08, 0x10, 0x00)
    assert head[:4] == bytes.fromhex("41 08 10 00")
    size = int.from_bytes(head[4:], "little")
    text, toggle = b"", 0
    while True:
        segment = sdo(node, 0x60 | toggle)
        assert segment[0] & 0x10 == toggle
        text += segment[1 : 8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
        if segment[0] & 1:
            break
    assert text == b"Emulated CiA 406 multi-turn encoder"
    assert len(text) == size


def test_a_segmented_write(node):
    assert sdo(node, 0x21, 0x17, 0x10, 0x00, 2, 0, 0, 0)[0] == 0x60
    assert sdo(node, 0x01 | (5 << 1), 0xE8, 0x03)[0] == 0x20
    assert read(node, 0x1017) == 1000


def test_a_write_without_size_takes_that_of_the_object(node):
    assert sdo(node, 0x22, 0x17, 0x10, 0x00, 0xE8, 0x03, 0xAA, 0xBB)[0] == 0x60
    assert read(node, 0x1017) == 1000


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ((0x40, 0x99, 0x99, 0), 0x06020000),  # no object
        ((0x40, 0x18, 0x10, 9), 0x06090011),  # no sub-index
        ((0x23, 0x04, 0x60, 0, 1, 0, 0, 0), 0x06010002),  # the position is read-only
        ((0x2F, 0x17, 0x10, 0, 1), 0x06070010),  # one byte into a u16
        ((0x2B, 0x00, 0x60, 0, 0xFF, 0xFF), 0x06090031),  # bits that 6000h does not have
        ((0x23, 0x01, 0x60, 0, 0, 0, 0, 0), 0x06090032),  # no units a turn
        ((0x2F, 0x03, 0x10, 0, 3), 0x06090030),  # the history takes only 0
        ((0x23, 0x10, 0x10, 1, 1, 2, 3, 4), 0x08000020),  # not the word "save"
        ((0x60,), 0x05040001),  # a segment of nothing
        ((0xA0, 0x08, 0x10, 0), 0x05040001),  # block upload
    ],
)
def test_refusals_carry_the_abort_code(node, request_, code):
    answer = sdo(node, *request_)
    assert answer[0] == 0x80
    assert struct.unpack_from("<I", answer, 4)[0] == code


def test_a_wrong_toggle_ends_the_transfer(node):
    sdo(node, 0x40, 0x08, 0x10, 0x00)
    assert struct.unpack_from("<HBI", sdo(node, 0x70), 1) == (0x1008, 0, 0x05030000)
    assert struct.unpack_from("<I", sdo(node, 0x60), 4)[0] == 0x05040001


def test_an_abort_of_the_client_has_no_answer(node):
    sdo(node, 0x40, 0x08, 0x10, 0x00)
    assert node.handle(CanFrame(0x601, bytes((0x80, 0x08, 0x10, 0, 0, 0, 0, 0))), 0.0) == []
    assert node.handle(CanFrame(0x601, b"\x40\x00\x10"), 0.0) == []  # an SDO has 8 bytes


# --- PDO


def test_the_documented_position_on_sync(node):
    nmt(node, 0x01)
    assert sync(node) == [CanFrame(0x281, bytes.fromhex("00 00 04 00"))]


@pytest.mark.parametrize("n", [1, 3, 240])
def test_type_n_sends_on_every_nth_sync(node, n):
    assert write(node, 0x1801, 2, n, 1) == 0
    nmt(node, 0x01)
    assert [len(sync(node)) for _ in range(2 * n)] == ([0] * (n - 1) + [1]) * 2


@pytest.mark.parametrize("kind", [254, 255])
def test_event_types_follow_their_timer(node, kind):
    assert write(node, 0x1800, 2, kind, 1) == 0
    assert write(node, 0x1800, 5, 10, 2) == 0
    nmt(node, 0x01)
    sent = [t for t in range(1, 51) for frame in node.due(t * 1e-3) if frame.id == 0x181]
    assert sent == [10, 20, 30, 40, 50]
    assert read(node, 0x6200) == 10  # the cyclic timer of CiA 406 is the same


@pytest.mark.parametrize("kind", [0, 241, 252, 253])
def test_other_transmission_types_are_refused(node, kind):
    assert write(node, 0x1801, 2, kind, 1) == 0x06090030


def test_mapping_two_objects_into_one_pdo(node):
    cob_id = read(node, 0x1801, 1)
    assert write(node, 0x1801, 1, cob_id | 1 << 31, 4) == 0
    assert write(node, 0x1A01, 0, 0, 1) == 0
    assert write(node, 0x1A01, 1, 0x65030010, 4) == 0
    assert write(node, 0x1A01, 2, 0x60040020, 4) == 0
    assert write(node, 0x1A01, 0, 2, 1) == 0
    assert write(node, 0x1801, 1, cob_id, 4) == 0
    nmt(node, 0x01)
    assert sync(node) == [CanFrame(0x281, bytes.fromhex("00 00 00 00 04 00"))]


def test_mappings_that_cannot_be(node):
    assert write(node, 0x1A01, 1, 0x65030010, 4) == 0x08000022  # the PDO is valid
    write(node, 0x1801, 1, read(node, 0x1801, 1) | 1 << 31, 4)
    assert write(node, 0x1A01, 1, 0x65030010, 4) == 0x08000022  # there are entries
    write(node, 0x1A01, 0, 0, 1)
    assert write(node, 0x1A01, 1, 0x60010020, 4) == 0x06040041  # not mappable
    assert write(node, 0x1A01, 1, 0x60040010, 4) == 0x06040041  # half an object
    for entry in (1, 2, 3):
        assert write(node, 0x1A01, entry, 0x60040020, 4) == 0
    assert write(node, 0x1A01, 0, 3, 1) == 0x06040042  # 96 bits


def test_an_invalid_pdo_is_not_sent(node):
    write(node, 0x1801, 1, read(node, 0x1801, 1) | 1 << 31, 4)
    nmt(node, 0x01)
    assert sync(node) == []


# --- emergencies and storage


def test_an_emergency_is_sent_registered_and_remembered(node):
    node.raise_emergency(0x7320)
    assert node.due(0.0) == [CanFrame(0x081, bytes.fromhex("20 73 21 01 00 00 00 00"))]
    assert (read(node, 0x1001), read(node, 0x6503), read(node, 0x1003, 0)) == (0x21, 1, 1)
    assert read(node, 0x1003, 1) == 0x7320
    node.raise_emergency(0)
    assert node.due(0.0) == [CanFrame(0x081, bytes(8))]
    assert (read(node, 0x1001), read(node, 0x6503), read(node, 0x1003, 0)) == (0, 0, 1)
    assert write(node, 0x1003, 0, 0, 1) == 0
    assert (read(node, 0x1003, 0), read(node, 0x1003, 1)) == (0, 0)


def test_the_newest_emergency_is_first_and_eight_are_kept(node):
    for code in range(0x1000, 0x100A):
        node.raise_emergency(code)
    assert read(node, 0x1003, 0) == 8
    assert [read(node, 0x1003, place) for place in (1, 8)] == [0x1009, 0x1002]


def test_settings_survive_a_reset_only_when_saved(node):
    write(node, 0x1017, 0, 500, 2)
    nmt(node, 0x81)
    assert read(node, 0x1017) == 0
    write(node, 0x1017, 0, 500, 2)
    assert write(node, 0x1010, 1, int.from_bytes(b"save", "little"), 4) == 0
    nmt(node, 0x81)
    assert read(node, 0x1017) == 500
    assert write(node, 0x1011, 1, int.from_bytes(b"load", "little"), 4) == 0
    nmt(node, 0x81)
    assert read(node, 0x1017) == 0


def test_a_silent_node_says_nothing(node):
    node.silent = True
    node.raise_emergency(0x1000)
    assert nmt(node, 0x01) == []
    assert sync(node) == []
    assert node.due(10.0) == []


@pytest.mark.parametrize("number", [0, 128])
def test_node_numbers_of_canopen(number):
    with pytest.raises(ValueError, match="1 to 127"):
        EncoderNode(number, lambda: 0.0)
