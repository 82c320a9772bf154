"""One mutation laid out, run and judged. As a program: the same by hand, kept in a folder, with the command to repeat.

.venv/bin/python -m tests.calibeam.mutations.cases 'model.json|predict_model.json_tracker:samples.csv' 17 --keep FOLDER
"""

import argparse
import re
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.calibeam.mutations.server import Ran, Server
from tests.calibeam.mutations.table import REFUSED, TABLE, Pair

LIMIT_S, LIMIT_BYTES = 60.0, 1_000_000_000  # of processor time, so that a busy machine finds no hang
WRITTEN = ("fleet", "begun")  # inputs that a command may write to
MESSAGE = 300  # characters
CODES = (0, 1, 3)  # good, failed, partial; 2 is for words of the command line, and those are right
SAID = {1: "error: ", 3: "stopped: "}  # how the line begins that says why


@dataclass(frozen=True)
class Fault:
    """What a run should not have done."""

    pair: Pair
    seed: int
    what: str

    def __str__(self) -> str:
        return f"{self.pair.mutator(self.seed).__name__}: {self.what}\n    again: cases '{self.pair.name}' {self.seed}"


def run_case(server: Server, good: Path, pair: Pair, seeds: range, folder: Path) -> tuple[Ran, list[Fault]]:
    """The run of one seed, or of as many as the command takes together."""
    lay_out(good, pair, seeds, folder)
    ran = server.run(pair.words.split(), folder, LIMIT_S, LIMIT_BYTES)
    return ran, [Fault(pair, seeds[0], what) for what in faults(pair, seeds[0], ran)]


def run_in_turn(server: Server, good: Path, pair: Pair, seeds: range, folder: Path) -> list[Fault]:
    """The same seeds in one process, one after the other; what looks wrong there is run again by itself."""
    folder.mkdir()
    folders = [folder / str(seed) for seed in seeds]
    for seed, own in zip(seeds, folders, strict=True):
        lay_out(good, pair, range(seed, seed + 1), own)
    runs = server.run_in_turn(pair.words.split(), folders, LIMIT_S, LIMIT_BYTES)
    suspect = [seed for k, seed in enumerate(seeds) if k >= len(runs) or faults(pair, seed, runs[k])]
    again = [run_case(server, good, pair, range(seed, seed + 1), folder / f"again-{seed}") for seed in suspect]
    return [fault for _, found in again for fault in found]


def lay_out(good: Path, pair: Pair, seeds: range, folder: Path) -> None:
    """The inputs with one of them mutated; together: session folders sets/s<seed>, each with one file mutated."""
    changed, _, name = pair.file.partition("/")
    folder.mkdir()
    for one in good.iterdir():
        if one.name in (changed, *WRITTEN):
            (shutil.copytree if one.is_dir() else shutil.copy)(one, folder / one.name)
        else:
            (folder / one.name).symlink_to(one)
    if not pair.together:
        (folder / pair.file).write_bytes(pair.mutated(good, seeds[0]))
        return
    for seed in seeds:
        shutil.copytree(good / changed, folder / "sets" / f"s{seed}")
        (folder / "sets" / f"s{seed}" / name).write_bytes(pair.mutated(good, seed))


def faults(pair: Pair, seed: int, ran: Ran) -> list[str]:
    """In words; none for a run as it should be."""
    if ran.killed:
        return [f"{ran.killed}: {ran.cpu_s:.1f} s of a core in {ran.seconds:.1f} s"]
    found: list[str] = []
    if "Traceback (most recent call last)" in ran.err + ran.out:
        found.append(f"traceback: {ran.err.strip().splitlines()[-1][:200]}")
    elif ran.code not in CODES:
        found.append(f"exit code {ran.code}: {(ran.err or ran.out)[-200:]}")
    elif ran.code in SAID and not re.search(rf"(?m)^{SAID[ran.code]}\S", ran.err):
        found.append(f"exit code {ran.code} without a line '{SAID[ran.code]}…': {ran.err[-200:]}")
    elif ran.code not in SAID and re.search(r"(?m)^(error|stopped): ", ran.err):
        found.append(f"exit code 0 with {ran.err[-200:]}")
    if "Warning: " in ran.err:
        found.append(f"a warning of a library: {ran.err.strip().splitlines()[0][:200]}")
    if ran.code == 0 and not pair.together and pair.kind in REFUSED.get(pair.mutator(seed).__name__, ()):
        found.append("was taken, exit code 0")
    found += [f"{len(m)} characters: {m[:160]}…{m[-60:]}" for m in messages(ran) if len(m) > MESSAGE]
    if ran.peak_bytes > LIMIT_BYTES:
        found.append(f"took {ran.peak_bytes / 1e6:.0f} MB")
    return found


def messages(ran: Ran) -> list[str]:
    """Sentences for a person about what is wrong: how the command ended, and devices that are not fit."""
    ended = re.split(r"(?m)^(?:error|stopped): ", ran.err)[1:]
    return [each.strip() for each in ended] + [line for line in ran.out.splitlines() if re.match(r"\S+ +error  ", line)]


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description="One mutation again: prints how the run ended.")
    parser.add_argument("pair", choices=[pair.name for pair in TABLE], metavar="PAIR")
    parser.add_argument("seed", type=int)
    parser.add_argument("--keep", type=Path, help="folder for the files, to run the command there by hand")
    asked = parser.parse_args(words)
    pair = next(pair for pair in TABLE if pair.name == asked.pair)
    with tempfile.TemporaryDirectory() as scratch:
        good, folder = Path(scratch) / "good", asked.keep or Path(scratch) / "case"
        seeds = range(asked.seed, asked.seed + max(1, pair.together))
        with Server(good) as server:
            ran, found = run_case(server, good, pair, seeds, folder)
    print(ran.out, ran.err, sep="\n")
    print(f"cd {folder}; calibeam {pair.words}", file=sys.stderr)
    print(f"{pair.mutator(asked.seed).__name__}: code {ran.code}, {ran.seconds:.2f} s, {ran.peak_bytes / 1e6:.0f} MB")
    for one in found:
        print(one)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
