"""Two folders: `recording` with what a site would hand over, `sealed` with the truth."""

import json
from pathlib import Path
from typing import Any

from simulators.conceal.belief import rig_document
from simulators.conceal.case import Case
from simulators.conceal.reveal import truth_document
from simulators.conceal.rig import Artefacts
from simulators.conceal.table import Column, csv_text, session_columns
from simulators.conceal.toml_text import toml_text

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
