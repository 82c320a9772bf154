"""Small files that would fill the memory, or the day, of whoever reads them: one line a file and the command it is for.

.venv/bin/python -m tests.calibeam.mutations.bombs [--only WORD]     each with its time and its largest memory

Every one is at most 32 MB. A command answers it in 60 s and 1 GB, taken or refused.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.calibeam.mutations import bomb_makers as make
from tests.calibeam.mutations.cases import LIMIT_BYTES, LIMIT_S, Fault, faults, lay_out
from tests.calibeam.mutations.server import Ran, Server
from tests.calibeam.mutations.table import Pair

LARGEST_BYTES = 32_000_000
LAB, BAG = "--rig tracker/rig.toml --yes --out made", "--rig tracker/rig.toml --yes --out made.mcap"


@dataclass(frozen=True)
class Bomb:
    """A file in place of a good one, made of its bytes; and the command line that is given it."""

    file: str
    words: str
    made: Callable[[bytes], bytes]

    @property
    def name(self) -> str:
        return f"{self.file}-{self.made.__name__}-{self.words.split()[0]}"


def _of_sessions() -> list[Bomb]:
    found: list[Bomb] = []
    for made in (make.csv_rows, make.csv_columns, make.csv_empty_cells, make.csv_blank_lines, make.csv_texts):
        found.append(Bomb("tracker/samples.csv", "check tracker", made))
    for made in (make.parquet_equal_rows, make.parquet_long_texts, make.parquet_columns, make.parquet_wide_and_long):
        found.append(Bomb("columns/samples.parquet", "check columns", made))
    for made in (make.mcap_zeros, make.mcap_empty_messages, make.mcap_metadata, make.mcap_channels, make.mcap_claims):
        for words in ("check recording.mcap", "recover recording.mcap --out made.mcap"):
            found.append(Bomb("recording.mcap", words, made))
    for made in (make.mcap_zeros, make.mcap_empty_messages):
        for words in ("identify recording.mcap", "report recording.mcap", "diagnose recording.mcap"):
            found.append(Bomb("recording.mcap", words, made))
    for made in (make.csv_rows, make.csv_columns, make.csv_empty_cells):
        found.append(Bomb("streamed/streams/encoders.csv", "import streamed --out made.mcap", made))
    for made in (make.parquet_equal_rows, make.parquet_long_texts):
        found.append(Bomb("columned/streams/encoders.parquet", "import columned --out made.mcap", made))
    found.append(Bomb("streamed/streams/events.csv", "import streamed --out made.mcap", make.csv_events))
    found.append(Bomb("streamed/streams/streams.json", "import streamed --out made.mcap", make.json_objects))
    return found


TABLES = (
    Bomb("tracker/samples.csv", "predict model.json tracker/samples.csv", make.csv_more_rows),
    Bomb("turned/samples.csv", "tool-axes turned", make.csv_50_000_rows),
    Bomb("cycled/samples.csv", "iso9283 evaluate cycled --model model.json --frame fit --out made.json",
         make.csv_50_000_rows),
    Bomb("guided/samples.csv", "verify guided --model guided.json", make.csv_50_000_rows),
    Bomb("other/samples.csv", "compare tracker other", make.csv_rows),
    Bomb("poses.csv", "correct arm.json poses.csv --out made.csv", make.csv_rows),
    Bomb("poses.csv", "correct arm.json poses.csv --out made.csv", make.csv_columns),
    Bomb("points.csv", "psd-check rig.toml --points points.csv --no-wait", make.csv_rows),
    Bomb("points.csv", "psd-check rig.toml --points points.csv --no-wait", make.csv_columns),
    Bomb("taught.csv", "task teach cell.toml --rig rig.toml --poses taught.csv --out made.toml", make.csv_columns),
    Bomb("dh.csv", "rig new --from-dh dh.csv --out made.toml", make.csv_columns),
)  # fmt: skip
IMPORTED = (
    *(Bomb("lab.csv", f"import lab.csv {LAB}", one) for one in (
        make.lab_rows, make.csv_columns, make.lab_headings, make.lab_same_headings, make.csv_empty_cells,
        make.csv_blank_lines, make.lab_semicolons, make.lab_title,
    )),
    Bomb("lab.csv", f"import lab.csv --streams {LAB}.mcap", make.lab_headings),
    *(Bomb("lab.xlsx", f"import lab.xlsx {LAB}", one) for one in (
        make.xlsx_last_column, make.xlsx_zeros, make.xlsx_last_row, make.xlsx_dimension, make.xlsx_strings,
        make.xlsx_sheets, make.xlsx_members,
    )),
    *(Bomb("lab.parquet", f"import lab.parquet {LAB}", one) for one in (
        make.parquet_equal_rows, make.parquet_long_texts, make.parquet_columns, make.parquet_nested,
    )),
    *(Bomb("bag-mcap/bag-mcap.mcap", f"import bag-mcap {BAG}", one) for one in (
        make.mcap_zeros, make.mcap_bag_messages,
    )),
    Bomb("bag-db3/bag-db3.db3", f"import bag-db3 {BAG}", make.bag_rows),
    Bomb("bag-db3/metadata.yaml", f"import bag-db3 {BAG}", make.yaml_aliases),
    *(Bomb(f"bus.{kind}", f"import bus.{kind} --rig rig.toml --out made.mcap", made) for kind, made in (
        ("blf", make.blf_zeros), ("blf", make.blf_frames), ("log", make.can_lines), ("log", make.can_buses),
    )),
)  # fmt: skip
RECORDS = (
    Bomb("rig.toml", "check rig.toml", make.toml_arrays),
    Bomb("rig.toml", "check rig.toml", make.toml_tables),
    Bomb("plan.toml", "session rig.toml --plan plan.toml --out made --yes", make.toml_poses),
    Bomb("fit.toml", "identify tracker --plan fit.toml", make.toml_arrays),
    Bomb("fit.toml", "identify tracker --plan fit.toml", make.toml_stars),
    *(Bomb("model.json", "predict model.json tracker/samples.csv", one) for one in (
        make.json_objects, make.json_lists, make.json_names,
    )),
    Bomb("diagnosis.json", "report tracker --diagnosis diagnosis.json", make.json_objects),
    Bomb("psd1.json", "check rig.toml", make.json_objects),
    *(Bomb(f"weld.{kind}", f"correct arm.json weld.{kind} --out made.{kind}", made) for kind, made in (
        ("src", make.krl_poses), ("src", make.krl_frames), ("mod", make.rapid_poses), ("mod", make.rapid_tools),
        ("script", make.urscript_poses), ("script", make.urscript_tools), ("ls", make.fanuc_poses),
        ("src", make.spaces), ("script", make.digits), ("mod", make.brackets),
    )),
    *(Bomb("arm.xml", "rig new --from-mjcf arm.xml --tip-link tip --out made.toml", one) for one in (
        make.mjcf_userdata, make.mjcf_hfield, make.mjcf_texture, make.mjcf_replicate, make.mjcf_bodies,
        make.mjcf_memory, make.mjcf_composite, make.xml_entities,
    )),
    *(Bomb("arm.urdf", "rig new --from-urdf arm.urdf --out made.toml", one) for one in (
        make.urdf_chain, make.urdf_star, make.xml_entities,
    )),
)  # fmt: skip
BOMBS = (*_of_sessions(), *TABLES, *IMPORTED, *RECORDS)

OPEN: dict[str, str] = {}  # not yet within the bounds, and why


def run_bomb(
    server: Server, good: Path, bomb: Bomb, folder: Path, limit_s: float = LIMIT_S, limit_bytes: int = LIMIT_BYTES
) -> tuple[Ran, list[Fault]]:
    """How the command ends, and what it should not have done."""
    lay_out(good, Pair(bomb.file, bomb.words), range(1), folder)
    data = bomb.made((good / bomb.file).read_bytes())
    assert len(data) <= LARGEST_BYTES
    (folder / bomb.file).write_bytes(data)
    ran = server.run(bomb.words.split(), folder, limit_s, limit_bytes)
    either = Pair(bomb.file, bomb.words, together=1)  # it may be taken or refused
    return ran, [Fault(either, 0, what) for what in faults(either, 0, ran)]


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description="Every bomb: seconds of a core, memory, and how the command ended.")
    parser.add_argument("--only", default="")
    parser.add_argument("--after", type=int, default=0)
    parser.add_argument("--limit-s", type=float, default=LIMIT_S)
    parser.add_argument("--limit-mb", type=float, default=LIMIT_BYTES / 1e6)
    asked = parser.parse_args(words)
    bad = 0
    with tempfile.TemporaryDirectory() as scratch, Server(Path(scratch) / "good") as server:
        for bomb in [one for one in BOMBS if asked.only in one.name][asked.after :]:
            case = Path(scratch) / "case"
            ran, found = run_bomb(server, Path(scratch) / "good", bomb, case, asked.limit_s, int(asked.limit_mb * 1e6))
            kb = (case / bomb.file).stat().st_size / 1e3
            shutil.rmtree(case)
            bad += bool(found)
            said = "; ".join(one.what for one in found) or (ran.err or ran.out).strip()[-250:].replace("\n", " ")
            mark = "BAD " if found else "    "
            print(
                f"{mark}{bomb.name}: {kb:.0f} kB, {ran.cpu_s:.1f} s, {ran.peak_bytes / 1e6:.0f} MB: {said}", flush=True
            )
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
