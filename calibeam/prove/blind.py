"""The diagnosing process: `python -m calibeam.prove.blind [PHYSICS ...]`. It gets recordings, and nothing else.

One line of JSON in for each case, one out when its answer is written. It refuses to import the simulators, so that
nothing can be drawn again; the truth is under a key that another process holds.
"""

import json
import sys
import time
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

FORBIDDEN = "simulators"


class NoSimulators:
    """Import hook: a diagnosis that could draw the world again would prove nothing."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """ImportError for the simulators, nothing for all else."""
        if name.split(".")[0] == FORBIDDEN:
            raise ImportError(f"{name}: the diagnosing process of a proof may not import {FORBIDDEN}")
        return None


def answer(recording: Path, asked: Path, out: Path, simulation: Path) -> None:
    """Writes diagnosis.json and, where both models have it, unseen.npz with the tool at the poses asked.

    Where there is a simulation, compare.json instead.
    """
    from acquisition.recording import read
    from acquisition.recording.files import write_json
    from calibeam.prove.unseen import read_asked, tool_at, write_unseen
    from calibeam.results.comparison import compare
    from calibeam.results.diagnosis import diagnose_recording, diagnose_streams
    from calibrate.diagnose.record.file import write_diagnosis

    out.mkdir(parents=True, exist_ok=True)
    if simulation.is_dir():
        write_json(out / "compare.json", compare(read(recording), read(simulation)))
        return
    content = read(recording)
    if not len(content.samples):  # a motion
        write_diagnosis(out / "diagnosis.json", diagnose_streams(content)[1])
        return
    found, file = diagnose_recording(content)
    write_diagnosis(out / "diagnosis.json", file)
    if found.physics is None or not asked.is_file():
        return
    q_rad, approach = read_asked(asked)
    write_unseen(
        out / "unseen.npz",
        tool_at(found.physics.geometry, q_rad, approach),
        tool_at(found.physics.model, q_rad, approach),
    )


def forget(physics: Sequence[str]) -> None:
    """Take effects out of the catalogue: a check that what is not known is called unknown, and not another name."""
    from calibrate.model.effects import catalogue

    catalogue.EFFECTS = tuple(e for e in catalogue.EFFECTS if e.physics not in physics)


def main(without: Sequence[str]) -> None:
    """Until standard input ends. A case that fails gives the reason, and the next one is taken."""
    sys.meta_path.insert(0, NoSimulators())
    if without:
        forget(without)
    for line in sys.stdin:
        order = json.loads(line)
        began_s, error = time.process_time(), ""
        try:
            answer(*(Path(order[name]) for name in ("recording", "asked", "out", "simulation")))
        except Exception as reason:
            error = f"{type(reason).__name__}: {reason}"
        print(json.dumps({"cpu_s": time.process_time() - began_s, "error": error}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
