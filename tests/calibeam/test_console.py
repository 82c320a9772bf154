"""Text of files and devices reaches the terminal without escape sequences, and is never markup."""

import io
import shutil

import pytest

from acquisition.recording.files import cleaned
from calibeam.cli import run
from calibeam.console import Console
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

NASTY = "a\x1b]0;title\x07\x1b[2Jb"
WORDS = f"{NASTY} x [/] [red]y"
FOLDER = f"{NASTY} x [-]"


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn")
    write_case(conceal(Wanted("tracker", 5, samples=40)), folder)
    return folder / "recording"


def renamed(drawn, folder, name):
    """The session with a rig of this name, escapes written as TOML does."""
    shutil.copytree(drawn, folder)
    lines = (folder / "rig.toml").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("name"))
    lines[at] = 'name = "' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in name) + '"'
    (folder / "rig.toml").write_text("\n".join(lines) + "\n")
    return folder


CALLS = {
    "check": lambda f, out: ["check", str(f)],
    "identify": lambda f, out: ["identify", str(f), "--out", str(out / "m.json"), "--verbose"],
    "batch": lambda f, out: ["batch", str(f.parent), "--out", str(out / "fleet"), "--jobs", "1"],
    "compare": lambda f, out: ["compare", str(f), str(f), "--out", str(out / "c.json"), "--no-diagnose"],
    "design": lambda f, out: ["design", str(f / "rig.toml"), "--out", str(out / "p.toml"), "--poses", "8"],
    "export": lambda f, out: ["export", str(f), "--out", str(out / "e")],
    "no file": lambda f, out: ["identify", str(f / NASTY)],
    "no option": lambda f, out: ["identify", str(f), f"--{NASTY}", "1"],
    "no number": lambda f, out: ["identify", str(f), "--bootstrap", NASTY],
}


@pytest.mark.parametrize("call", CALLS)
def test_names_reach_the_terminal_as_text(call, drawn, tmp_path, capsys):
    folder = renamed(drawn, tmp_path / "in" / FOLDER, WORDS)
    (tmp_path / "out").mkdir()
    assert run(CALLS[call](folder, tmp_path / "out")) in (0, 1, 2, 3)
    shown = "".join(capsys.readouterr())
    assert "Traceback" not in shown
    assert not set(shown) & set("\x1b\x07\x9b")


def test_colours_of_the_program_itself_stay_on_a_terminal():
    screen = io.StringIO()
    Console(file=screen, force_terminal=True, color_system="standard", width=80).print(NASTY, style="bold")
    text = screen.getvalue()
    assert text.startswith("\x1b[1m")
    assert "\x1b[2J" not in text
    assert "\x1b]0" not in text


def test_line_ends_and_letters_of_every_language_stay():
    text = "Winkel 0.5°, µm\n\tΔ 角度"
    assert cleaned(text) == text
    assert cleaned("a\u202eb") == "a\ufffdb"
