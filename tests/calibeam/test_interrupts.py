"""Ctrl-C, SIGTERM and SIGHUP end a command once; what follows while it cleans up is not heard."""

import signal
import subprocess
import sys

import pytest

from calibeam.outcome import Interrupts

# Ten Ctrl-C while it cleans up, and ten more while the interpreter ends.
ENDS = """
import atexit, os, signal, sys
from calibeam import cli
signal.signal(signal.SIGHUP, signal.SIG_IGN if "nohup" in sys.argv else signal.SIG_DFL)
def ten(): [os.kill(os.getpid(), signal.SIGINT) for _ in range(10)]
def run(arguments):
    try:
        os.kill(os.getpid(), getattr(signal, arguments[0]))
        sys.stdin.read()
    except KeyboardInterrupt as why:
        ten()
        print("cleaned up after", str(why) or "Ctrl-C", flush=True)
        return 3
cli.run = run
atexit.register(ten)
cli.main()
"""


# Ctrl-C when a module is about to be loaded.
LOADS = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[-1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from calibeam.__main__ import main
main()
"""


@pytest.mark.parametrize("module", ["calibeam.cli", "numpy._core.multiarray", "calibeam.commands.identify"])
def test_ctrl_c_while_the_program_loads_is_one_sentence(module) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOADS, "identify", module], capture_output=True, text=True, timeout=60.0
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "stopped by Ctrl-C\n")


@pytest.mark.parametrize(
    ("number", "name"), [(signal.SIGINT, ""), (signal.SIGTERM, "SIGTERM"), (signal.SIGHUP, "SIGHUP")]
)
def test_the_first_one_is_heard_and_those_after_it_are_not(number, name) -> None:
    interrupts = Interrupts()
    with pytest.raises(KeyboardInterrupt) as raised:
        interrupts.came(number, None)
    assert str(raised.value) == name
    interrupts.came(number, None)


def test_nothing_is_heard_while_a_command_closes_but_a_question_hears_again() -> None:
    interrupts = Interrupts()
    interrupts.close()
    interrupts.came(signal.SIGINT, None)
    interrupts.heed()
    with pytest.raises(KeyboardInterrupt):
        interrupts.came(signal.SIGINT, None)


def test_a_command_that_was_started_to_outlive_its_terminal_does() -> None:
    done = subprocess.run(
        [sys.executable, "-c", ENDS, "SIGHUP", "nohup"], stdin=subprocess.DEVNULL, capture_output=True, timeout=60.0
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


@pytest.mark.parametrize(("name", "said"), [("SIGINT", "Ctrl-C"), ("SIGTERM", "SIGTERM"), ("SIGHUP", "SIGHUP")])
def test_ten_more_change_neither_exit_code_nor_clean_up(name, said) -> None:
    done = subprocess.run(
        [sys.executable, "-c", ENDS, name], stdin=subprocess.PIPE, capture_output=True, text=True, timeout=60.0
    )
    assert (done.returncode, done.stdout, done.stderr) == (3, f"cleaned up after {said}\n", "")
