"""A session that was gone on with: recording.mcap, recording-0002.mcap, ..., parts of one session in one folder."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from acquisition.recording.errors import RecordingError
from acquisition.recording.recording import Recording, time_utc
from acquisition.recording.rig import Rig
from acquisition.recording.samples import Kind, Samples, kind_of

FIRST = "recording.mcap"
_LATER = re.compile(r"recording-(\d{4})\.mcap")

SAME = ("arm", "tool", "fixture")  # what of the rig makes the samples of two parts samples of one session


def parts(folder: Path) -> list[Path]:
    """The parts in their order; none where the folder holds no session's recording."""
    first = folder / FIRST
    if not first.exists():
        return []
    return [first, *sorted(path for path in folder.iterdir() if _LATER.fullmatch(path.name))]


def next_part(folder: Path) -> Path:
    """Where the next part goes; nothing that is there is touched."""
    there = parts(folder)
    if not there:
        return folder / FIRST
    match = _LATER.fullmatch(there[-1].name)
    return folder / f"recording-{1 + (1 if match is None else int(match[1])):04d}.mcap"


def joined(each: Sequence[Recording], folder: Path) -> Recording:
    """All samples and events of the parts as one recording, under the rig of the last one.

    Times of later parts count on from the first by the calendar, for a machine's own clock begins again when it is
    started. Streams are left out where there is more than one part: each stands under clocks of its own part.
    RecordingError where the parts are of different arms, or of places that have moved.
    """
    if len(each) == 1:
        return replace(each[0], path=folder)
    first, last = each[0], each[-1]
    for other in each[:-1]:
        _check_same(other, last)
    later_s = [_later_s(first, other) for other in each]
    return replace(
        last,
        path=folder,
        samples=_stacked([other.samples for other in each], later_s),
        damage=tuple(f"{other.path.name}: {says}" for other in each for says in other.damage),
        host=first.host,
        started_utc=first.started_utc,
        host_s0=first.host_s0,
        notes={**first.notes, "parts": str(len(each))},
        streams={},
        events=tuple(
            replace(event, host_s=event.host_s - other.host_s0 + first.host_s0 + shift_s)
            for other, shift_s in zip(each, later_s, strict=True)
            for event in other.events
        ),
    )


def _later_s(first: Recording, other: Recording) -> float:
    try:
        return (time_utc(other.started_utc) - time_utc(first.started_utc)).total_seconds()
    except ValueError as error:
        raise RecordingError(f"{other.path}: started_utc '{other.started_utc}' is no date ({error})") from error


def _check_same(one: Recording, other: Recording) -> None:
    if said := differs(one.rig, other.rig):
        raise RecordingError(
            f"{one.path.name} and {other.path.name} are no parts of one session: {said}; put them into folders of "
            "their own"
        )


def differs(earlier: Rig, later: Rig) -> str:
    """What keeps samples of both rigs from being one session; empty where nothing does. New places do not."""
    for name in SAME:
        if getattr(earlier, name) != getattr(later, name):
            return f"[{name}] of the rig has changed"
    moved = [k for k, place in earlier.placements.items() if later.placements.get(k) != place]
    return f"[[placement]] {moved[0]} of the rig has changed" if moved else ""


def _stacked(tables: Sequence[Samples], later_s: Sequence[float]) -> Samples:
    names = dict.fromkeys(name for table in tables if len(table) for name in table.names)
    columns = {name: np.concatenate([_column(table, name) for table in tables]) for name in names}
    shift = np.concatenate([np.full(len(table), s) for table, s in zip(tables, later_s, strict=True)])
    shifted: Mapping[str, np.ndarray] = {**columns, "t_s": columns["t_s"] + shift} if columns else tables[0].columns
    return Samples(shifted, tables[0].n_joints)


def _column(table: Samples, name: str) -> np.ndarray:
    if name in table:
        return table.columns[name]
    return np.full(len(table), "" if kind_of(name) is Kind.TEXT else np.nan)
