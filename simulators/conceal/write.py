"""Two folders: `recording` with what a site would hand over (samples.csv, rig.toml), `sealed` with the truth."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.case import Case
from simulators.conceal.case_files import truth_document
from simulators.conceal.rig import Artefacts
from simulators.conceal.rig_file import rig_document
from simulators.conceal.toml_text import toml_text
from simulators.defects import Scene

Floats = NDArray[np.float64]
Column = Sequence[float | int | str | None]
THERMOMETER_K = 0.05  # one sigma of a cheap probe


def session_columns(
    scene: Scene,
    reading_rad: Floats,
    repeat: NDArray[np.int64],
    recorded: frozenset[str],
    rng: np.random.Generator,
    artefacts: Artefacts | None = None,
) -> dict[str, Column]:
    """Everything but the instrument's own columns. `recorded`: "approach", "qd", "cmd", "payload_kg", "temp_..."."""
    n = reading_rad.shape[1]
    columns: dict[str, Column] = {"t_s": scene.t_s.tolist()}
    columns |= {f"q{joint + 1}_rad": reading_rad[:, joint].tolist() for joint in range(n)}
    if scene.placement.any():
        columns |= {"placement": scene.placement.tolist(), "first_psd": scene.first_psd.tolist()}
    if artefacts is not None:
        columns |= _seats(scene, artefacts)
    if repeat.any():
        columns["repeat"] = [number or None for number in repeat.tolist()]
    if "approach" in recorded:
        sign = np.sign(np.round(scene.last_move_rad, 9)).astype(np.int64)
        columns |= {f"approach{joint + 1}": sign[:, joint].tolist() for joint in range(n)}
    if "qd" in recorded:
        columns |= {f"qd{joint + 1}_rad_s": scene.qd_rad_s[:, joint].tolist() for joint in range(n)}
    if "cmd" in recorded:
        columns |= {f"cmd{joint + 1}_rad": scene.goal_rad[:, joint].tolist() for joint in range(n)}
    if "payload_kg" in recorded:
        columns["payload_kg"] = scene.payload_kg.tolist()
    for name in sorted(recorded):
        if name.startswith("temp_"):
            degC = scene.temperature_degC[name.removeprefix("temp_").removesuffix("_degC")]
            columns[name] = np.round(degC + THERMOMETER_K * rng.standard_normal(len(scene)), 3).tolist()
        elif name in scene.extra:
            columns[name] = np.round(scene.extra[name], 6).tolist()
    return columns


def _seats(scene: Scene, artefacts: Artefacts) -> dict[str, Column]:
    """Cones by number; ends of bars by bar and end."""
    end = scene.seat - 1 - artefacts.cones
    at_bar = end >= 0
    columns: dict[str, Column] = {
        "seat": [None if bar else seat for seat, bar in zip(scene.seat.tolist(), at_bar, strict=True)]
    }
    if at_bar.any():
        number = [int(artefacts.held[e // 2]) + 1 if e >= 0 else None for e in end.tolist()]
        columns |= {"bar": number, "bar_end": ["ab"[e % 2] if e >= 0 else None for e in end.tolist()]}
    return columns


def csv_text(columns: Mapping[str, Column]) -> str:
    """Header and rows; a missing cell is empty."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, column) for column in columns.values()), strict=True))
    return text.getvalue()


def _cell(value: float | int | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else repr(value)


SUM_NOISE_V = 1e-3  # one sigma of a 12-bit converter over 5 V
VALUES = {
    "dual-psd": ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m"),
    "tracker": ("x_m", "y_m", "z_m"),
    "wire": ("wire_m",),
    "cones": (),
}


def write_case(case: Case, folder: Path) -> None:
    """Writes `folder`/recording/rig.toml and samples.csv, and `folder`/sealed/truth.json."""
    recording, sealed = folder / "recording", folder / "sealed"
    recording.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    (recording / "rig.toml").write_text(toml_text(rig_document(case.belief)), encoding="utf-8")
    (recording / "samples.csv").write_text(csv_text(columns(case)), encoding="utf-8", newline="")
    truth: dict[str, Any] = truth_document(case)
    (sealed / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def columns(case: Case) -> dict[str, Column]:
    """All columns of samples.csv."""
    instrument = case.drawn.true.instrument
    artefacts = instrument if isinstance(instrument, Artefacts) else None
    written = session_columns(case.table.scene, case.reading_rad, case.table.repeat, case.recorded, case.rng, artefacts)
    for channel, name in enumerate(VALUES[case.wanted.family]):
        written[name] = case.values_m[:, channel].tolist()
    if case.second_rad is not None:
        written |= {f"enc{joint}_rad": said.tolist() for joint, said in enumerate(case.second_rad.T, start=1)}
    if case.exact.sum_v is not None:
        noisy_v = case.exact.sum_v + SUM_NOISE_V * case.rng.standard_normal(case.exact.sum_v.shape)
        for sensor, name in enumerate(("psd1_sum_v", "psd2_sum_v")):
            if name not in case.withheld:
                written[name] = noisy_v[:, sensor].tolist()
    return written
