"""Which command reads which file, and how it is called: a new command or format is one line here.

A command that talks to devices reads its files and then finds no device, for inputs.py names none that is there; one
that would emulate a whole session stops at its output folder.
"""

import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath

import numpy as np

from calibeam.command_list import COMMANDS
from tests.calibeam.mutations.json_mutators import JSON
from tests.calibeam.mutations.recording_mutators import RECORDING
from tests.calibeam.mutations.table_mutators import CSV, PARQUET, WORKBOOK
from tests.calibeam.mutations.text_mutators import BINARY, LINES, TOML, Mutator

KINDS = {
    ".toml": "toml", ".json": "json", ".csv": "csv", ".parquet": "parquet", ".mcap": "recording", ".blf": "binary",
    ".log": "lines", ".asc": "lines", ".dbc": "lines", ".jsonl": "lines",
    ".urdf": "lines", ".xml": "lines", ".src": "lines", ".script": "lines", ".mod": "lines", ".ls": "lines",
    ".xlsx": "workbook", ".yaml": "lines", ".db3": "binary",
}  # fmt: skip
MUTATORS: dict[str, tuple[Mutator, ...]] = {
    "toml": TOML, "json": JSON, "csv": CSV, "lines": LINES, "binary": BINARY, "parquet": PARQUET,
    "recording": RECORDING, "workbook": WORKBOOK, "others' csv": CSV,  # which may be of another encoding
}  # fmt: skip
OTHERS = {"bus.csv": "lines", "lab.csv": "others' csv", "bag-mcap/bag-mcap.mcap": "binary"}  # of their suffix
REFUSED = {"bad_utf8": ("toml", "json", "csv")}  # what no reader of these kinds may take
SMALL = "--arms 500 --poses 2"  # of an error simulation
DAILY, ENDURE = 4, int(os.environ.get("SEEDS", "100"))
SOME = 2  # daily, of a format whose first command is slow on a valid input
FEW = 1  # daily, where another command has read the format
SLOW = (
    "calibrate",
    "diagnose",
    "compare",
    "design",
    "excite",
    "simulate-errors",
    "iso9283",
    "report",
    "reconcile",
)  # on a valid input


@dataclass(frozen=True)
class Pair:
    """A file that is mutated, and a command line that reads it; paths from the folder of the inputs on."""

    file: str
    words: str
    together: int = 0  # so many mutated session folders in the folder "sets" at a time, for commands over a fleet
    kind: str = field(init=False)

    def __post_init__(self) -> None:
        kind = OTHERS.get(self.file, KINDS[PurePosixPath(self.file).suffix])
        object.__setattr__(self, "kind", kind)

    @property
    def command(self) -> str:
        return self.words.split()[0]

    @cached_property
    def daily(self) -> int:
        """Seeds of every day: of the first line of a format and a command; others read it by the same code.

        Most of what is wrong with a file is found by its reader, whichever command calls it: the first command that
        reads a format has many, those after it fewer, which try what each does with what its reader lets pass.
        """
        alike = [pair for pair in TABLE if pair.format == self.format]
        first = next(pair for pair in alike if pair.command == self.command)
        if first is not self:
            return 0
        if alike[0] is self:
            return SOME if self.command in SLOW else DAILY
        return FEW

    @cached_property
    def format(self) -> str:
        return PurePosixPath(self.file).name

    @property
    def name(self) -> str:
        """Of the test: file and command, with the words that tell it from others of the same command."""
        return f"{self.file}|{self.words}".replace(" ", "_").replace("/", ":")

    def mutator(self, seed: int) -> Mutator:
        """All in turn; beginning with another one for each pair."""
        kinds = MUTATORS[self.kind]
        return kinds[(seed + zlib.crc32(self.name.encode())) % len(kinds)]

    def mutated(self, good: Path, seed: int) -> bytes:
        rng = np.random.default_rng([zlib.crc32(self.file.encode()), seed])
        return self.mutator(seed)(rng, (good / self.file).read_bytes())


def _of_sessions() -> Iterator[Pair]:
    """Whatever reads a session folder or a recording."""
    for file in ("tracker/samples.csv", "tracker/rig.toml", "columns/samples.parquet", "recording.mcap"):
        what = file if file.endswith(".mcap") else file.partition("/")[0]
        yield Pair(file, f"check {what}" if "rig" not in file else "check tracker")
        yield Pair(file, f"identify {what} --export urdf --export json")
        yield Pair(file, f"diagnose {what}")
        yield Pair(file, f"report {what}")
        yield Pair(file, f"calibrate {what} --out made")
        yield Pair(file, f"compare {what} other")
        yield Pair(file, f"export {what} --out made")
        if not file.endswith(".mcap"):
            yield Pair(file, f"import {what} --out made.mcap")
    for folder in ("dual-psd", "cones", "wire"):
        for file in ("samples.csv", "rig.toml"):
            for command in ("identify", "diagnose", "report"):
                yield Pair(f"{folder}/{file}", f"{command} {folder}")
    for file, what in (("turned/samples.csv", "turned"), ("turned/rig.toml", "turned"), ("turned.mcap", "turned.mcap")):
        yield Pair(file, f"tool-axes {what}")
    for file, what in (("guided/samples.csv", "guided"), ("guided/rig.toml", "guided"), ("guided.mcap", "guided.mcap")):
        yield Pair(file, f"verify {what} --model guided.json")


SESSIONS = tuple(_of_sessions())
OTHER_SESSIONS = (
    Pair("other/samples.csv", "compare tracker other"),
    Pair("other/samples.csv", "report tracker --against other"),
    Pair("tracker/samples.csv", "report tracker --model model.json"),
    Pair("tracker/samples.csv", "predict model.json tracker/samples.csv"),
    Pair("columns/samples.parquet", "predict model.json columns/samples.parquet"),
    Pair("tracker/samples.csv", "batch sets --out fleet --jobs 2", together=20),
    Pair("tracker/rig.toml", "batch sets --out fleet --jobs 2", together=20),
    Pair("recording.mcap", "recover recording.mcap --out made.mcap"),
    Pair("recording.mcap", "report tracker --against recording.mcap"),
    Pair("streams.mcap", "recover streams.mcap --out made.mcap"),
    Pair("streams.mcap", "check streams.mcap"),
    Pair("streams.mcap", "export streams.mcap --out made --streams"),
    Pair("streams.mcap", "export streams.mcap --out made --streams --table parquet"),
    Pair("streams.mcap", "export streams.mcap --out made.blf"),
    Pair("streams.mcap", "compare streams.mcap streams.mcap"),
    Pair("streamed/streams/streams.json", "import streamed --out made.mcap"),
    Pair("streamed/streams/encoders.csv", "import streamed --out made.mcap"),
    Pair("streamed/streams/events.csv", "import streamed --out made.mcap"),
    Pair("streamed/streams/gaps.csv", "import streamed --out made.mcap"),
    Pair("columned/streams/encoders.parquet", "import columned --out made.mcap"),
    Pair("begun/recording.mcap", "session rig.toml --continue --out begun --yes"),
)
MODELS = (
    Pair("model.json", "predict model.json tracker/samples.csv"),
    Pair("physics.json", "predict physics.json tracker/samples.csv --same-session"),
    Pair("physics.json", "report tracker --model physics.json"),
    Pair("tracker/samples.csv", "predict physics.json tracker/samples.csv --same-session"),
    Pair("model.json", f"simulate-errors model.json --errors errors.toml {SMALL}"),
    Pair("model.json", f"simulate-errors model.json --errors errors.toml {SMALL} --out made"),
    Pair("model.json", "report tracker --model model.json"),
    Pair("model.json", "report tracker --against model.json"),
    Pair("earlier/model.json", "report tracker --against earlier"),
    Pair("model.json", "diagnose tracker --model model.json"),
    Pair("guided.json", "verify guided --model guided.json"),
    Pair("arm.json", "correct arm.json poses.csv --out made.csv"),
    Pair("poses.csv", "correct arm.json poses.csv --out made.csv"),
    *(
        Pair(f"weld.{one}", f"correct arm.json weld.{one} --out made.{one} --joint-targets")
        for one in ("src", "script", "mod", "ls")
    ),
    Pair("model.json", "iso9283 evaluate cycled --model model.json --out made.json"),
    Pair("cycled/samples.csv", "iso9283 evaluate cycled --model model.json --frame fit --out made.json"),
    Pair("cycled/rig.toml", "iso9283 evaluate cycled/samples.csv --rig cycled/rig.toml --out made.json"),
    Pair("model.json", "export-model model.json --to urdf --out made.urdf"),
    Pair("physics.json", "export-model physics.json --to mjcf --out made.xml"),
    Pair("model.json", "replay tracker --model model.json --out made.mcap"),
    Pair("tracker/samples.csv", "replay tracker --model model.json --out made.mcap"),
    Pair("tracker/rig.toml", "replay tracker --model model.json --out made.mcap"),
    Pair("recording.mcap", "replay recording.mcap --model model.json --out made.mcap"),
    Pair("longer/rig.toml", "reconcile longer --simulation tracker/rig.toml --out made"),
    Pair("longer/samples.csv", "reconcile longer --simulation tracker/rig.toml --out made"),
    Pair("tracker/rig.toml", "reconcile longer --simulation tracker/rig.toml --out made"),
    Pair("long/recording.mcap", "reconcile long/recording.mcap --simulation tracker/rig.toml --out made"),
    Pair("arm.json", "live rig.toml --model arm.json --port 0 --for-s 0"),
    Pair("arm.json", "move rig.toml --home --model arm.json --dry-run"),
    Pair("arm.json", "jog rig.toml --joint 1 --by-deg 1 --model arm.json --dry-run"),
    Pair("diagnosis.json", "report tracker --diagnosis diagnosis.json"),
    Pair("earlier/diagnosis.json", "report tracker --against earlier"),
)
RIGS = (
    Pair("rig.toml", "check rig.toml"),
    Pair("rig.toml", "session rig.toml --out made --yes"),
    Pair("rig.toml", "emulate rig.toml --end-with-stdin --robot-host auto"),
    Pair("rig.toml", "live rig.toml --port 0 --for-s 0"),
    Pair("rig.toml", "centre rig.toml --out made.mcap --yes"),
    Pair("arm.urdf", "rig new --from-urdf arm.urdf --out made.toml"),
    Pair("arm.xml", "rig new --from-mjcf arm.xml --tip-link tip --out made.toml"),
    Pair("arm.urdf", "compare tracker --simulation arm.urdf"),
    Pair("arm.xml", "compare tracker --simulation arm.xml"),
    Pair("dh.csv", "rig new --from-dh dh.csv --out made.toml"),
    Pair("tracked.toml", "session tracked.toml --out made --yes"),
    Pair("tracked.toml", "check tracked.toml"),
    Pair("tracked.toml", "log tracker tracked.toml --out made --for-s 0"),
    Pair("rig.toml", "log encoders rig.toml --out made --for-s 0"),
    Pair("rig.toml", "design rig.toml --poses 8 --repeats 0 --candidates 4"),
    Pair("rig.toml", "excite rig.toml --length-s 4 --repeats 1 --out made.toml"),
    Pair("rig.toml", "iso9283 plan rig.toml --cycles 2 --centre-m 0.5 0 0.3 --edge-m 0.2 --out made.toml"),
    Pair("rig.toml", "move rig.toml --home --dry-run"),
    Pair("rig.toml", "jog rig.toml --axis z --by-mm 1 --dry-run"),
    Pair("rig.toml", "motion --rig rig.toml --out points.csv"),
    Pair("rig.toml", "demo --rig rig.toml --out begun"),
    Pair("rig.toml", "psd-check rig.toml --points points.csv --out made.json --no-wait"),
    Pair("rig.toml", f"simulate-errors rig.toml --only joint2.* {SMALL}"),
    Pair("rig.toml", "import bus.log --rig rig.toml --out made.mcap"),
    Pair("rig.toml", "recover streams.mcap --rig rig.toml --out made.mcap"),
    Pair("eye.toml", "camera eye.toml --out made --yes"),
    Pair("eye.toml", "check eye.toml"),
    Pair("guided/rig.toml", "session guided/rig.toml --out made"),
    Pair("guided/rig.toml", "session guided/rig.toml --out made --verify"),
    Pair("guided/rig.toml", "emulate guided/rig.toml --end-with-stdin"),
    Pair("guided/rig.toml", f"simulate-errors guided/rig.toml --only joint2.* {SMALL}"),
)
PLANS = (
    Pair("cycles.toml", "iso9283 evaluate cycled --plan cycles.toml --out made.json"),
    Pair("motion.toml", "session rig.toml --motion motion.toml --out made --yes"),
    Pair("plan.toml", "session rig.toml --plan plan.toml --out made --yes"),
    Pair("fit.toml", "identify tracker --plan fit.toml"),
    Pair("task.toml", "move rig.toml --task task.toml --position bin --dry-run"),
    Pair("cell.toml", "task run cell.toml --rig rig.toml --dry-run"),
    Pair("taught.toml", "task run taught.toml --rig rig.toml --dry-run"),
    Pair("cell.toml", "task teach cell.toml --rig rig.toml --poses taught.csv --out made.toml"),
    Pair("taught.csv", "task teach cell.toml --rig rig.toml --poses taught.csv --out made.toml"),
    Pair("errors.toml", f"simulate-errors tracker/rig.toml --errors errors.toml {SMALL}"),
)
DEVICES = (
    *(
        Pair(f"bus.{suffix}", f"import bus.{suffix} --rig rig.toml --out made.mcap")
        for suffix in ("log", "asc", "blf", "csv")
    ),
    *(
        Pair(f"lab.{suffix}", f"import lab.{suffix} --rig tracker/rig.toml --yes --out made")
        for suffix in ("xlsx", "csv", "parquet")
    ),
    Pair("lab.csv", "import lab.csv --streams --rig tracker/rig.toml --yes --out made.mcap"),
    *(
        Pair(file, f"import {file.partition('/')[0]} --rig tracker/rig.toml --yes --out made.mcap")
        for file in ("bag-db3/metadata.yaml", "bag-db3/bag-db3.db3", "bag-mcap/bag-mcap.mcap")
    ),
    Pair("encoders.dbc", "check rig.toml"),
    Pair("encoders.dbc", "log encoders rig.toml --out made --for-s 0"),
    Pair("encoders.dbc", "live rig.toml --port 0 --for-s 0"),
    Pair("psd1.json", "check rig.toml"),
    Pair("psd1.json", "live rig.toml --port 0 --for-s 0"),
    Pair("psd1.json", "session rig.toml --out made --yes"),
    Pair("camera.json", "check eye.toml"),
    Pair("camera.json", "session eye.toml --out made --yes"),
    Pair("points.csv", "psd-check rig.toml --points points.csv --no-wait"),
    Pair("fleet/fleet.rows.jsonl", "batch fleet-of-one --out fleet --jobs 1"),
    Pair("fleet/fleet.parquet", "batch fleet-of-one --out fleet --jobs 1"),
)
TABLE = (*SESSIONS, *OTHER_SESSIONS, *MODELS, *RIGS, *PLANS, *DEVICES)

# Commands that read no file, and files that no command reads from outside.
EXEMPT = {"prove": "makes every file that it reads"}
UNREAD = {
    "truth.json": "demo writes it and reads it again in the same run, in a folder that it has emptied before",
    "proof.json": "prove writes it for the page and for its own table; no command takes one",
}


def missing() -> set[str]:
    """Commands of the program that stand neither in the table nor among the exemptions."""
    return set(COMMANDS) - {pair.command for pair in TABLE} - EXEMPT.keys()
