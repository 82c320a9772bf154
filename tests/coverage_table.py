"""A line a package: lines of code that the tests reached; then the ten files of which they reached the smallest share.

Functions that numba compiles count as not reached: their machine code is not watched.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

FEWEST = 20  # lines of a file that is worth a name
NAMED = 10


def main(path: Path) -> None:
    files = json.loads(path.read_text())["files"]
    lines: defaultdict[str, list[int]] = defaultdict(lambda: [0, 0])
    for name, file in files.items():
        found = file["summary"]
        for k, key in enumerate(("covered_lines", "num_statements")):
            lines[name.split("/")[0]][k] += found[key]
    print(
        *(f"{package:>12}: {100.0 * a / b:5.1f} % of {b} lines" for package, (a, b) in sorted(lines.items())), sep="\n"
    )
    shares = {n: f["summary"]["percent_covered"] for n, f in files.items() if f["summary"]["num_statements"] >= FEWEST}
    print(
        "least reached:", *(f"{shares[n]:9.1f} % {n}" for n in sorted(shares, key=shares.__getitem__)[:NAMED]), sep="\n"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
