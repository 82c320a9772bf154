"""`python -m tests.golden.renew [NAME...]`: freezes what the program answers today. Only where a change is meant.

Names are those of the files in data/expected, without their suffix; without a name all are made again. The inputs are
never made again.
"""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from . import answers
from .agreement import findings
from .program import Json
from .published import frozen_table


@contextmanager
def _folder() -> Iterator[Path]:
    with TemporaryDirectory() as name:
        yield Path(name)


def _each(names: tuple[str, ...], answer: Callable[[str, Path], Json]) -> Json:
    made: Json = {}
    for name in names:
        print(f"  {name}", flush=True)
        with _folder() as folder:
            made[name] = answer(name, folder)
    return made


def zeros() -> Json:
    made = _each(("demo", *answers.TRUTHS), answers.zeros)
    for name in answers.TRUTHS:
        for zero, off in answers.sigmas_off(made[name], name).items():
            made[name][zero]["sigmas_off"] = round(off, 4)
    return made


def diagnoses() -> Json:
    names = tuple(sorted(path.name for path in answers.SESSIONS.iterdir()))
    return _each(names, lambda name, folder: findings(answers.diagnosis(name, folder)))


def real() -> Json:
    with _folder() as folder:
        made = {"ur5-tracker": answers.ur5(folder)}
    return made | _each(answers.ROBOTS, answers.ur10)


def formats() -> Json:
    with _folder() as folder:
        made = {"streams": answers.streams(folder)}
    with _folder() as folder:
        return made | {"demo": answers.exported_demo(folder)}


MADE: dict[str, Callable[[], Json]] = {
    "zeros": zeros,
    "fitted": lambda: _each(tuple(answers.FITTED), answers.fitted),
    "diagnoses": diagnoses,
    "real": real,
    "predicted": lambda: _each(tuple(answers.PREDICTED), answers.prediction),
    "formats": formats,
}


def main(names: list[str]) -> int:
    """0 good, 2 for a name that is none."""
    if unknown := [name for name in names if name not in (*MADE, "proof")]:
        print(f"{', '.join(unknown)}: choose from {', '.join((*MADE, 'proof'))}", file=sys.stderr)
        return 2
    for name in names or (*MADE, "proof"):
        print(name, flush=True)
        if name == "proof":
            frozen_table().write_text(_published_table(), encoding="utf-8")
            continue
        text = json.dumps(MADE[name](), indent=1)
        (answers.DATA / "expected" / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    return 0


def _published_table() -> str:
    """Of the published seed, as `make prove-table` has put it there."""
    text = (Path(__file__).parents[2] / "docs" / "figures.md").read_text(encoding="utf-8")
    return text.partition("<!-- proof: begin -->\n")[2].partition("<!-- proof: end -->")[0]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
