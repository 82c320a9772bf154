"""`calibeam psd-check`: signs, scale and error map of one detector, from spots at known places."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import SamplesError
from acquisition.recording.files import shown
from acquisition.recording.output import text_output, write_output
from acquisition.recording.rig import load_rig
from acquisition.recording.rig.devices import PsdDevice
from acquisition.wires.psd_view import psd_window
from calibeam.asking import Asking, NotAgreedError, at_terminal, someone
from calibeam.devices.instruments import PsdInstrument, psd_driver
from calibeam.overwriting import writes
from drivers.clock import SystemClock
from drivers.device import Block
from drivers.errors import DeviceRefused
from drivers.psd_error_map import FORMAT, MapFit, MapStatus, fit_error_map
from drivers.psd_faces import Face
from drivers.psd_kpa101.pair import counts_of
from drivers.psd_kpa101.selfcheck import CheckStatus, UnitCheck, check_unit

Floats = NDArray[np.float64]
READ_S = 1.0
COLUMNS = ("x_m", "y_m")
NO_WAIT = "give --no-wait where something else moves the spot"
LARGEST_M = 0.1  # of a place from the middle; faces are some centimetres long
RIG_DIFFERS = "the rig file has"


@dataclass(frozen=True)
class Seen:
    """What one face showed at every place: spots as shown (place, 2) m, counts (place, 3) of a KPA101 or none."""

    shown_m: Floats
    counts: Floats | None


@writes(out=text_output(FORMAT, "error map"))
def psd_check_command(rig: Path, *, points: Path, unit: int = 1, out: Path | None = None, wait: bool = True) -> None:
    """Check a detector against known spot positions.

    Finds the sign of x, the scale of the sum signal (KPA101) and an error map.

    For example:

    ```
    calibeam psd-check rig.toml --points points.csv --unit 1 --out psd1.json
    ```

    Parameters
    ----------
    rig
        The rig file.
    points
        CSV with columns x_m, y_m: where the spot is put, one place after the other; 4 by 4 or more for a map.
    unit
        The face: 1 or 2.
    out
        Where to write the error map, to be named in error_maps of the rig.
    wait
        Wait for ENTER at each place. With --no-wait something else moves the spot, and nothing is asked.

    """
    place_m = _places(points)
    if unit not in (1, 2):
        raise SamplesError(f"--unit {unit}: the faces are 1 and 2")
    ready = asked_at(someone(at_terminal(), "at each place", NO_WAIT)) if wait else _say_nothing
    loaded = load_rig(rig)
    device = loaded.devices.psd
    if device is None:
        raise DeviceRefused(f"rig {loaded.name}: no [devices.psd]; name the detectors in the rig file")
    psd = psd_driver(structs.replace(device, error_maps=None), loaded, SystemClock())  # they are measured again
    psd.connect()
    try:
        face = _face(psd, device, unit)
        seen = collect(psd, face, unit, place_m, ready)
    finally:
        psd.close()
    lines: list[str] = []
    if seen.counts is not None:
        lines = unit_lines(check_unit(place_m, seen.counts, face.metres_per_ratio), device, unit)
        for line in lines:
            print(line)
    fit = fit_error_map(place_m, seen.shown_m, 0.5 * face.length_m)
    print(map_line(fit))
    if out is not None and any(RIG_DIFFERS in line for line in lines):
        # A map of spots that the rig mirrors or scales would do so a second time once the rig is put right.
        raise SamplesError(f"{out}: not written; correct {rig} first, then measure the map again")
    if out is not None and fit.map is not None:
        write_output(out, fit.map.text(), text_output(FORMAT, "error map"))
        print(f"{out}: written; name it in error_maps of [devices.psd]")


def collect(psd: PsdInstrument, face: Face, unit: int, place_m: Floats, ready: Callable[[int, Floats], None]) -> Seen:
    """Averages READ_S at every place, once `ready` confirms that the spot is there. DeviceRefused where it is dark."""
    shown: list[tuple[float, float]] = []
    counts: list[Floats] = []
    for number, place in enumerate(place_m, 1):
        ready(number, place)
        blocks = _read_for(psd, READ_S)
        mean = face.mean(psd_window(blocks).current_a[:, 4 * unit - 4 : 4 * unit])
        if not np.isfinite([mean.x_m, mean.y_m]).all():
            raise DeviceRefused(f"{psd.name}: no light on face {unit} at place {number}; leave that place out")
        shown.append((mean.x_m, mean.y_m))
        each = [sent for block in blocks if (sent := counts_of(block.values, unit)) is not None]
        if each:
            counts.append(np.concatenate(each).mean(axis=0))
    return Seen(np.array(shown), np.array(counts) if counts else None)


def unit_lines(check: UnitCheck, device: PsdDevice, unit: int) -> list[str]:
    """What was measured beside what the rig file has, a remedy where they differ."""
    if check.status is not CheckStatus.GOOD or check.x is None or check.y is None:
        return [f"unit {unit}: {check.status.value}"]
    lines: list[str] = []
    for name, measured, said in (
        ("x_signs", check.x.sign, device.x_signs[unit - 1]),
        ("y_signs", check.y.sign, device.y_signs[unit - 1]),
    ):
        verdict = "as in the rig" if measured == said else f"{RIG_DIFFERS} {said}: correct {name}"
        lines.append(f"unit {unit}: {name} {measured}, {verdict}")
    scale = check.sum_full_scale_v
    if scale is not None:
        value_v, sigma_v = scale
        said_v = device.sum_full_scale_v[unit - 1]
        near = abs(value_v - said_v) <= max(3.0 * sigma_v, 0.05 * said_v)  # the rest is the map's gain
        verdict = "as in the rig" if near else f"{RIG_DIFFERS} {said_v:g}: correct sum_full_scale_v"
        lines.append(f"unit {unit}: sum_full_scale_v {value_v:.4g} ± {sigma_v:.2g}, {verdict}")
    return lines


def map_line(fit: MapFit) -> str:
    if fit.status is not MapStatus.GOOD or fit.map is None:
        return f"no error map: {fit.status.value}"
    gains = (fit.map.x_m[1] / fit.map.half_length_m, fit.map.y_m[1] / fit.map.half_length_m)
    return (
        f"error map: gain {gains[0]:.4f}, {gains[1]:.4f}; "
        f"spots missed their places by {fit.before_m * 1e6:.1f} µm rms, with the map by {fit.after_m * 1e6:.1f} µm"
    )


def _face(psd: PsdInstrument, device: PsdDevice, unit: int) -> Face:
    if psd.identity is None:
        raise DeviceRefused(f"{psd.name}: not identified; connect it first")
    found = psd.identity.faces[unit - 1]
    try:
        return Face(found.kind, found.length_m, device.spot_radius_m)
    except ValueError as error:
        raise DeviceRefused(f"[devices.psd] of the rig file: {error}") from error


def _read_for(psd: PsdInstrument, seconds: float) -> list[Block]:
    """Blocks of that much device time, the first one left out: it may be of before."""
    first = psd.read(READ_S)
    blocks: list[Block] = []
    while not blocks or blocks[-1].device_s[-1] - first.device_s[-1] < seconds:
        blocks.append(psd.read(READ_S))
    return blocks


def _places(path: Path) -> Floats:
    try:
        with path.open(newline="", encoding="utf-8-sig") as lines:
            rows = [[float(row[name]) for name in COLUMNS] for row in csv.DictReader(lines)]
    except (KeyError, ValueError, TypeError, UnicodeDecodeError, csv.Error) as error:
        raise SamplesError(f"{path}: {shown(str(error))}; it needs columns {', '.join(COLUMNS)} of numbers") from error
    if not rows:
        raise SamplesError(f"{path}: no places; give a row for each place of the spot")
    for number, row in enumerate(rows, 1):
        for name, value in zip(COLUMNS, row, strict=True):
            if not abs(value) <= LARGEST_M:
                raise SamplesError(f"{path} row {number}: {name} = {value:g} lies beyond any face; give metres")
    return np.array(rows)


def asked_at(asking: Asking) -> Callable[[int, Floats], None]:
    """Asks for the spot at each place. NotAgreedError, when it is called, on a refusal or the end of input."""

    def ask(number: int, place: Floats) -> None:
        where = f"x = {place[0] * 1e3:+z.3f} mm, y = {place[1] * 1e3:+z.3f} mm"
        if not asking.enter(f"place {number}: put the spot at {where}"):
            raise NotAgreedError(f"the check was ended at place {number}; nothing was written")

    return ask


def _say_nothing(number: int, place: Floats) -> None:
    """Somebody else moves the spot."""
