"""A tap hears every frame, sent and received, and changes nothing."""

import can

from drivers.transports.can_bus import TappedBus, tapped


def test_every_frame_is_shown_and_passed_on() -> None:
    shown: list[tuple[int, bool]] = []
    open_bus = tapped(
        lambda: can.Bus("tap", interface="virtual"),
        lambda messages, sent: shown.extend((message.arbitration_id, sent) for message in messages),
    )
    with can.Bus("tap", interface="virtual") as there, open_bus() as bus:
        bus.send(can.Message(arbitration_id=1, is_extended_id=False))
        there.send(can.Message(arbitration_id=2, is_extended_id=False))
        heard = bus.recv(1.0)
        assert heard is not None
        assert heard.arbitration_id == 2
        assert there.recv(1.0).arbitration_id == 1
        assert bus.recv(0.0) is None
    assert shown == [(1, True), (2, False)]


def test_what_closes_the_tap_closes_the_bus() -> None:
    inner = can.Bus("closed", interface="virtual")
    bus = TappedBus(inner, lambda messages, sent: None)
    assert bus.channel_info == inner.channel_info
    bus.shutdown()
    assert inner._is_shutdown
