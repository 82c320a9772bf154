"""The console command `calibeam`: one line a subcommand, errors as one sentence, exit codes a script can rely on.

0 good, 1 failed, 2 wrong usage, 3 partial (what was recorded is kept, but the job did not end as asked).
"""

import signal
import sys
from importlib.metadata import version
from types import FrameType

from cyclopts import App, CycloptsError
from rich.console import Console
from rich.markup import escape

from acquisition.errors import AcquisitionError
from acquisition.recording.errors import RecordingError, RigFileError, SamplesError
from calibeam.commands.check import check_command
from calibeam.commands.compare import compare_command
from calibeam.commands.demo import demo
from calibeam.commands.diagnose import diagnose_command
from calibeam.commands.emulate import emulate
from calibeam.commands.export import export_command, import_command
from calibeam.commands.identify import identify_command
from calibeam.commands.jog import jog_command
from calibeam.commands.log import log
from calibeam.commands.motion import motion_command
from calibeam.commands.move import move_command
from calibeam.commands.predict import predict_command
from calibeam.commands.prove import prove_command
from calibeam.commands.psd_check import psd_check_command
from calibeam.commands.recover import recover_command
from calibeam.commands.report import report_command
from calibeam.commands.session import session
from calibeam.commands.tool_axes import tool_axes_command
from calibeam.emulation import EmulationError
from calibeam.outcome import CheckFailed, PartialResult
from calibeam.prove.seal import BrokenSealError
from calibrate.errors import DataError
from drivers.errors import DeviceError
from simulators.conceal.wanted import ConcealError
from simulators.host.errors import HostError
from simulators.world.errors import WorldError

# What is told in one sentence instead of a traceback: everything that is about the user's world, not about our code.
TOLD = (
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

app = App(
    name="calibeam",
    version=version("calibeam"),
    help="Record, calibrate and diagnose robot arms with a laser and two position-sensitive detectors.",
    suppress_keyboard_interrupt=False,  # it would end with 130 and no word
)
app.command(demo)
app.command(session)
app.command(emulate)
app.command(check_command, name="check")
app.command(log)
app.command(identify_command, name="identify")
app.command(diagnose_command, name="diagnose")
app.command(compare_command, name="compare")
app.command(predict_command, name="predict")
app.command(prove_command, name="prove")
app.command(report_command, name="report")
app.command(tool_axes_command, name="tool-axes")
app.command(psd_check_command, name="psd-check")
app.command(move_command, name="move")
app.command(jog_command, name="jog")
app.command(motion_command, name="motion")
app.command(export_command, name="export")
app.command(import_command, name="import")
app.command(recover_command, name="recover")


def main() -> None:
    """Run the command line; ends the process with one of the four exit codes."""
    for number in (signal.SIGTERM, signal.SIGHUP):  # a closed terminal must leave the arm standing, too
        signal.signal(number, _interrupt)
    sys.exit(run(sys.argv[1:]))


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def run(arguments: list[str]) -> int:
    """The exit code of one command line."""
    errors = Console(stderr=True, soft_wrap=True, highlight=False)
    try:
        app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return 2  # cyclopts has printed what was wrong
    except PartialResult as partial:
        errors.print(f"[bold]stopped:[/bold] {escape(str(partial))}")
        return 3
    except KeyboardInterrupt:
        errors.print("stopped by Ctrl-C")
        return 1
    except TOLD as error:
        errors.print("error:", str(error), markup=False)
        return 1
    except OSError as error:  # a folder that cannot be made or written; devices' own are DeviceErrors above
        errors.print(
            "error:", f"{error.filename or 'file'}: {error.strerror or error}; choose another --out", markup=False
        )
        return 1
    return 0
