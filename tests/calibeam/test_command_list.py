import os
import subprocess
import sys

import pytest

from calibeam.cli import app
from calibeam.command_list import GROUPS

LISTED = [command for group in GROUPS.values() for command in group]


@pytest.mark.parametrize("command", LISTED, ids=lambda command: command.name)
def test_the_list_repeats_the_first_line_of_each_command(command) -> None:
    loaded = app[command.name]
    text = loaded.help if loaded.default_command is None else loaded.default_command.__doc__
    assert text.splitlines()[0] == command.summary


def test_help_imports_no_command() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", "import sys; from calibeam.cli import run; run(['--help']); print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "Start here" in ended.stdout
    loaded = ended.stdout.splitlines()[-1].split()
    assert [name for name in loaded if name.startswith(("calibeam.commands.", "scipy", "mujoco", "matplotlib"))] == []


def test_a_reader_that_has_had_enough_ends_the_output_without_a_word():
    """As `calibeam --help | head -1`; the pipe is closed before anything was written."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "calibeam", "rig", "list"],
            stdout=closed,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
    assert (done.returncode, done.stderr) == (0, "")
