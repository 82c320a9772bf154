"""A laboratory's table (degrees, millimetres, own names) as a session folder that calibeam reads.

python docs/examples/lab_table.py lab.csv session/samples.csv   beside a session/rig.toml
"""

import sys
from pathlib import Path

import numpy as np

JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")  # degrees, as the controller said
POINT = ("X", "Y", "Z")  # millimetres, in the tracker's own frame


def convert(table: Path, samples: Path) -> int:
    """Rows written. Units are converted here and nowhere else: everything behind this line is SI."""
    lab = np.atleast_1d(np.genfromtxt(table, delimiter=",", names=True, dtype=float))
    columns = {"t_s": np.arange(len(lab), dtype=float)}
    columns |= {f"q{i}_rad": np.radians(lab[name]) for i, name in enumerate(JOINTS, start=1)}
    columns |= {f"{axis.lower()}_m": lab[axis] / 1000.0 for axis in POINT}
    header, rows = ",".join(columns), np.column_stack(list(columns.values()))
    samples.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(samples, rows, delimiter=",", header=header, comments="", fmt="%.12g")
    return len(lab)


if __name__ == "__main__":
    print(convert(Path(sys.argv[1]), Path(sys.argv[2])), "rows")
