"""`calibeam verify`: the figures of ISO 10360-12 and ASME B89.4.22 of an identified arm."""

from pathlib import Path
from typing import Annotated

import msgspec
from cyclopts import Parameter
from rich.table import Table

from acquisition.recording import read
from acquisition.recording.files import write_json
from acquisition.recording.output import json_output
from calibeam.console import Console
from calibeam.geometry_only import read_geometry
from calibeam.outcome import CheckFailed
from calibeam.overwriting import writes
from calibeam.software import SOFTWARE
from calibrate.quantities import DASH, length
from calibrate.report.elements.html import page_output
from calibrate.report.verification_page import SAYS, write_verification_page
from calibrate.verify import Verification, verification_file, verify


@writes(out=json_output("calibeam-verification"), report=page_output("verification"))
def verify_command(
    recording: Path,
    *,
    model: Path,
    out: Path = Path("verification.json"),
    report: Path = Path("verification.html"),
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Verify a measuring arm by spheres, cones and length bars.

    Compares each figure with the permissible error in the rig's [mpe].

    For example:

    ```
    calibeam verify check/recording.mcap --model session/model.json
    ```

    Exit code 1 when a figure is beyond its limit; the files are written all the same.

    Parameters
    ----------
    recording
        What `calibeam session RIG --verify` took: readings that the identification has not seen.
    model
        The model.json of the identified arm.
    out
        Where to write the figures as JSON.
    report
        Where to write the page.
    json_
        Print the JSON and nothing else.

    """
    source = read(recording)
    found = verify(source, read_geometry(model))
    file = verification_file(found, rig=source.rig.name, recording=recording.name, model=model.name, software=SOFTWARE)
    write_json(out, file)
    report.parent.mkdir(parents=True, exist_ok=True)
    write_verification_page(report, source, found, SOFTWARE)
    if json_:
        print(msgspec.json.encode(file).decode())
    else:
        _print(Console(), found, out, report)
    if found.failed:
        raise CheckFailed(found.sentence)


def _print(console: Console, found: Verification, out: Path, report: Path) -> None:
    table = Table("figure", "worst", "permitted", "", "taken")
    for one in found.figures:
        worst, limit = (DASH if value is None else length(value) for value in (one.value, one.permitted))
        table.add_row(one.symbol, worst, limit, SAYS[one.judgement], f"{one.taken} of {one.asked}")
    console.print(table)
    console.print(found.sentence, highlight=False, markup=False)
    for line in found.left_out:
        console.print(line, highlight=False, markup=False)
    console.print(f"figures: {out}; page: {report}", highlight=False, markup=False)
