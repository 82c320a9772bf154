"""What MkDocs asks of the program: tables that would be wrong the day after if they were written by hand."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

from calibeam.cli import app
from calibeam.command_list import COMMANDS
from calibeam.simulation.mechanism_table import TABLE
from calibrate.model.effects.catalogue import EFFECTS
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.torque import TORQUES

OPEN = "unknown"
SHIM = "https://unpkg.com/iframe-worker/shim"  # which the theme names for pages that are opened from a folder
ROOT = Path(__file__).parents[1]


def effects() -> str:
    """One row a physics; several files may tell of one."""
    return _of_kinds(EFFECTS)


def torques() -> str:
    """One row a cause of torque."""
    return _of_kinds(TORQUES)


def _of_kinds(kinds: Sequence[Kind]) -> str:
    rows = ["| physics | what it is | easily mistaken for | source |", "|---|---|---|---|"]
    rows += [
        f"| `{e.physics}` | {e.explains} | {', '.join(f'`{name}`' for name in e.mistaken_for)} | {e.source} |"
        for e in kinds
        if e.physics != OPEN
    ]
    return "\n".join(rows)


def mechanisms() -> str:
    """One row for each entry of the table from effects to mechanisms."""
    rows = ["| effect | form | mechanism | what crosses over, and its unit | may differ by |", "|---|---|---|---|---|"]
    rows += [
        f"| `{form.physics}` | {form.name} | `{to.mechanism.KIND}` | {to.crosses} | "
        f"{100.0 * to.within:.0f} %{': ' + to.differs if to.differs else ''} |"
        for form, to in TABLE.items()
    ]
    return "\n".join(rows)


def commands() -> str:
    pages = [app[name].generate_docs(heading_level=2, usage_name=f"calibeam {name}") for name in COMMANDS]
    return "\n\n".join(pages).replace(f"{ROOT}/", "")


def decisions() -> str:
    notes = sorted((Path(__file__).parent / "decisions").glob("0*.md"))
    return "\n".join(f"- [{_title(note)}]({note.name})" for note in notes)


def _title(note: Path) -> str:
    return note.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")


TABLES: dict[str, Callable[[], str]] = {
    "effects": effects,
    "torques": torques,
    "mechanisms": mechanisms,
    "commands": commands,
    "decisions": decisions,
}


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Called by MkDocs for every page: a mistyped include is no include, and nobody else would say so."""
    if "--8" in html or "{{ " in html:
        raise PluginError(f"{page.file.src_path}: an include or a table was left as it is")
    return html


def on_page_markdown(markdown: str, **_: object) -> str:
    """Called by MkDocs for every page."""
    return re.sub(r"\{\{ (\w+) \}\}", lambda found: TABLES[found[1]](), markdown)


def on_post_page(output: str, page: Page, **_: object) -> str:
    """Called by MkDocs for every page as it is written: what the search needs from a folder is in the folder."""
    here = "../" * page.file.dest_uri.count("/") + "javascripts/worker-of-file.js"
    return output.replace(SHIM, here)


def on_post_template(output: str, template_name: str, **_: object) -> str:
    """The same for 404.html, which is no page."""
    return output.replace(SHIM, "javascripts/worker-of-file.js")
