"""`calibeam recover`: a whole recording of what is good in a torn or damaged one."""

from pathlib import Path

import msgspec

from acquisition.recording import recover
from acquisition.recording.rig import rig_text
from calibeam.outcome import PartialResult


def recover_command(recording: Path, *, out: Path, rig: Path | None = None, json: bool = False) -> None:
    """Save what is readable of a damaged recording.

    What can be read of a damaged or cut-off recording goes into a new, complete file.

    For example:

    ```
    calibeam recover session-1/recording.mcap --out recovered.mcap
    ```

    Every batch is proved by its checksum: what is in the new file is as it was recorded. Ends with 0 when nothing was
    wrong, 3 when something is lost (the new file lists it), 1 when nothing can be had.

    Parameters
    ----------
    recording
        The torn or damaged recording; it is left as it is.
    out
        The recording to make.
    rig
        A rig file to put in the place of one that is damaged.
    json
        Print what was kept and what is lost on one line, and nothing else.

    """
    done = recover(recording, out, None if rig is None else rig_text(rig))
    if json:
        kept = {"out": str(out), "messages": done.messages, "whole": done.whole, "damage": done.damage}
        print(msgspec.json.encode(kept).decode())
    else:
        print(f"{out}: messages: {done.messages}")
    if not done.whole:
        why = "; ".join(done.damage) or "the recording was cut short before its end"
        raise PartialResult(f"{recording}: {why}; what is readable is in {out}")
