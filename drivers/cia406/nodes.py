"""All encoders of a bus found and configured, side by side."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import can
import canopen

from drivers.cia406.configuration import EncoderIdentity, EncoderObjects, check_profile, configure
from drivers.errors import DeviceStale

NMT_START, NMT_PRE_OPERATIONAL = 0x01, 0x80


def configured(name: str, network: canopen.Network, nodes: Sequence[int]) -> tuple[EncoderIdentity, ...]:
    """Every node pre-operational and set up. DeviceStale naming all that are missing, not one after the other.

    DeviceRefused as `configure`. The nodes are asked side by side, a thread each until all are done: one after the
    other six take six times as long, which with a slow adapter is more than a second.
    """
    encoders: list[EncoderObjects] = []
    for node in nodes:
        remote = network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary()))
        remote.nmt.send_command(NMT_PRE_OPERATIONAL)
        encoders.append(EncoderObjects(name, node, remote))
    with ThreadPoolExecutor(len(encoders)) as side_by_side:
        answered = list(side_by_side.map(_answers, encoders))
    missing = [encoder.number for encoder, there in zip(encoders, answered, strict=True) if not there]
    if missing:
        raise DeviceStale(
            f"{name}: no answer from encoder node {', '.join(map(str, missing))} of {len(nodes)}; "
            "check power, node numbers, bit rate and bus termination"
        )
    with ThreadPoolExecutor(len(encoders)) as side_by_side:
        return tuple(side_by_side.map(configure, encoders))


def nmt(command: int, node: int) -> can.Message:
    """A network management command to one node (CiA 301, 7.2.8)."""
    return can.Message(arbitration_id=0, data=[command, node], is_extended_id=False)


def _answers(encoder: EncoderObjects) -> bool:
    """Whether the node is there; DeviceRefused when it is no encoder."""
    try:
        check_profile(encoder)
    except DeviceStale:
        return False
    return True
