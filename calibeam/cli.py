"""The console command `calibeam`: one line a subcommand, errors as one sentence, exit codes a script can rely on.

0 good, 1 failed, 2 wrong usage, 3 partial (what was recorded is kept, but the job did not end as asked).
"""

import errno
import os
import sys
from importlib.metadata import version

from cyclopts import App, CycloptsError, Group, Parameter
from rich.text import Text

from acquisition.errors import AcquisitionError
from acquisition.recording import RecordingError, RigFileError, SamplesError
from acquisition.recording.files import brief
from calibeam.command_list import COMMANDS, GROUPS
from calibeam.console import Console, clean_streams
from calibeam.emulation import EmulationError
from calibeam.outcome import INTERRUPTS, CheckFailed, PartialResult, interruption
from calibeam.prove.seal import BrokenSealError
from calibrate.errors import DataError
from drivers.errors import DeviceError
from simulators.conceal.wanted import ConcealError
from simulators.errors import HostError, WorldError

# Reported in one sentence instead of a traceback: everything that is about the user's world, not about our code.
REPORTED = (
    AcquisitionError,
    BrokenSealError,
    CheckFailed,
    ConcealError,
    DataError,
    DeviceError,
    EmulationError,
    HostError,
    RecordingError,
    RigFileError,
    SamplesError,
    WorldError,
)
# Libraries that not every job needs, and the extra of the installation that brings each.
EXTRAS = {"cv2": "camera", "distributed": "fleet", "foxglove": "viewers", "rosbags": "ros"}


def _new_app() -> App:
    return App(
        name="calibeam",
        version=version("calibeam"),
        help="Record, calibrate and diagnose robot arms, from laser spots, a tracker, a wire, cones or your tables.",
        default_parameter=Parameter(negative_iterable=(), consume_multiple=True),  # several values: --only a b
        suppress_keyboard_interrupt=False,  # cyclopts would end with 130 and no message
    )


app = _new_app()
# Loaded when it is called: emulators, for one, start three seconds sooner without the others' libraries.
for name, place in COMMANDS.items():
    app.command(f"calibeam.commands.{place}", name=name)


def main() -> None:
    """Run the command line; ends the process with one of the four exit codes."""
    code = 1
    try:
        INTERRUPTS.listen()  # a closed terminal must leave the arm standing, too
        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # before the first instruction of a command, or while its last line was printed
        pass
    finally:
        INTERRUPTS.end()
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """The exit code of one command line."""
    with clean_streams():
        return _run(arguments)


def _run(arguments: list[str]) -> int:
    errors = Console(stderr=True, soft_wrap=True, highlight=False)
    asked = _list_of_commands() if not arguments or arguments[0] in app.help_flags else app
    asked.console, asked.error_console = Console(), Console(stderr=True)
    try:
        asked(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return 2  # cyclopts has printed what was wrong
    except PartialResult as partial:
        errors.print(Text.assemble(("stopped:", "bold"), f" {brief(str(partial))}"))
        return 3
    except KeyboardInterrupt as interrupt:
        errors.print(f"stopped by {interruption(interrupt)}")
        return 1
    except REPORTED as error:
        errors.print("error:", brief(str(error)), markup=False)
        return 1
    except ModuleNotFoundError as missing:
        if (library := (missing.name or "").partition(".")[0]) not in EXTRAS:
            raise
        remedy = f'pip install "calibeam[{EXTRAS[library]}]", which brings it'
        errors.print(f"error: this needs the library {library}, which is not installed; {remedy}", markup=False)
        return 1
    except MemoryError:
        errors.print("error: this machine has not enough memory for these files; give fewer rows, or close programs")
        return 1
    except BrokenPipeError:  # `calibeam rig list | head`: who reads has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:  # a folder that cannot be made or written; devices' own are DeviceErrors above
        errors.print("error:", f"{error.filename or 'file'}: {error.strerror or error}{_remedy(error)}", markup=False)
        return 1
    return 0


def _remedy(error: OSError) -> str:
    """Inputs and outputs fail alike: a path that is not there may be the one or the folder of the other."""
    match error:
        case FileNotFoundError():
            return "; check the path"
        case PermissionError() | FileExistsError() | IsADirectoryError() | NotADirectoryError():
            return "; check the path, or choose another --out"
        case _ if error.errno == errno.ENOSPC:
            return "; free space, or choose another --out"
        case _:
            return ""


def _list_of_commands() -> App:
    """All commands in their groups, none of them loaded."""
    listed = _new_app()
    for title, commands in GROUPS.items():
        group = Group.create_ordered(title)
        for command in commands:
            listed.command(f"calibeam.commands.{command.place}", name=command.name, help=command.summary, group=group)
    return listed
