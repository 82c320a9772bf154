"""Concealed cases with streams: a fault of motion, stamps or second encoders, in a recording as a session leaves it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from acquisition.recording import Channel, Event, RecordingWriter
from calibeam.software import SOFTWARE
from simulators.conceal.belief import rig_document
from simulators.conceal.case import Case
from simulators.conceal.toml_text import toml_text
from simulators.conceal.write import columns
from simulators.streams.devices import HOST_S
from simulators.streams.fault import Fault
from simulators.streams.faults import FAULTS
from simulators.streams.session import StreamedSession, streamed

HEALTHY = 0.25  # share of the cases with streams in which nothing is wrong
UNITS = {"target_q_rad": "rad", "actual_q_rad": "rad", "position_rad": "rad", "photocurrent_a": "A"}


class _HostTime:
    """Of a session that is written long after it was drawn."""

    def now_s(self) -> float:
        return HOST_S


def conceal_streams(case: Case, mechanism: str | None, path: Path) -> tuple[Fault, ...]:
    """Draws a fault, or none, and writes the recording; returns what is wrong with it."""
    rng = np.random.default_rng([case.wanted.seed, 21])
    among = [kind for kind in FAULTS if mechanism in (None, kind.KIND)]
    kind = among[int(rng.integers(len(among)))]
    wrong = rng.random() >= HEALTHY or mechanism is not None
    fault = kind.draw(rng, case.posture_rad.shape[1]) if wrong else None
    session = streamed(case, fault, rng)
    _write(case, session, path)
    return () if fault is None else (fault,)


def told(faults: tuple[Fault, ...]) -> list[dict[str, Any]]:
    """For the truth, in the words that a mechanism of the chain has there."""
    return [
        {
            "mechanism": fault.KIND,
            "physics": fault.PHYSICS,
            "port": fault.port,
            "drivers": list(fault.drivers),
            "fields": dict(vars(fault)),
            "figures": dict(fault.figures),
            "enr": fault.size,
        }
        for fault in faults
    ]


def _write(case: Case, session: StreamedSession, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    text = toml_text(rig_document(case.belief))
    with RecordingWriter(path, rig_text=text, software=SOFTWARE, clock=_HostTime(), host_s0=HOST_S) as writer:
        for row in _rows(case, session):
            writer.sample(row, HOST_S + float(row["t_s"]))
        for (from_s, to_s), at_s in zip(session.window_s.tolist(), session.read_s.tolist(), strict=True):
            writer.event(Event(HOST_S + at_s, "sample", {"psd_from_s": from_s, "psd_to_s": to_s}))
        for name, stream in session.streams.items():
            channels = tuple(Channel(c, UNITS[c], values.shape[1:]) for c, values in stream.values.items())
            writer.stream(name, channels).append(stream.host_s, stream.device_s, stream.sequence, stream.values)


def _rows(case: Case, session: StreamedSession) -> list[Mapping[str, Any]]:
    """The samples of the case, at the times at which the streams have them."""
    table = columns(case) | {"t_s": session.read_s.tolist()}
    return [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]
