"""The console command `calibeam`: one line a subcommand, errors as one sentence, exit codes a script can rely on.

0 good, 1 failed, 2 wrong usage, 3 partial (what was recorded is kept, but the job did not end as asked).
"""

import sys
from importlib.metadata import version

from cyclopts import App, CycloptsError
from rich.console import Console
from rich.markup import escape

from acquisition.errors import AcquisitionError
from acquisition.recording.errors import RecordingError, RigFileError, SamplesError, brief
from calibeam.emulation import EmulationError
from calibeam.interrupts import INTERRUPTS
from calibeam.outcome import CheckFailed, PartialResult, interruption
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
# Loaded when it is called: emulators, for one, start three seconds sooner without the others' libraries.
COMMANDS = {
    "demo": "demo:demo",
    "session": "session:session",
    "emulate": "emulate:emulate",
    "check": "check:check_command",
    "log": "log:log",
    "identify": "identify:identify_command",
    "diagnose": "diagnose:diagnose_command",
    "compare": "compare:compare_command",
    "predict": "predict:predict_command",
    "design": "design:design_command",
    "simulate-errors": "simulate_errors:simulate_errors_command",
    "prove": "prove:prove_command",
    "report": "report:report_command",
    "verify": "verify:verify_command",
    "tool-axes": "tool_axes:tool_axes_command",
    "psd-check": "psd_check:psd_check_command",
    "move": "move:move_command",
    "jog": "jog:jog_command",
    "motion": "motion:motion_command",
    "camera": "camera:camera_command",
    "live": "live:live_command",
    "export": "export:export_command",
    "import": "export:import_command",
    "recover": "recover:recover_command",
    "batch": "batch:batch_command",
    "layouts": "layouts:layouts_command",
    "completion": "completion:completion_command",
}
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
    errors = Console(stderr=True, soft_wrap=True, highlight=False)
    if not arguments or arguments[0] in app.help_flags:
        for name in COMMANDS:
            app[name]  # loads it, so that the list of all says what each does
    try:
        app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return 2  # cyclopts has printed what was wrong
    except PartialResult as partial:
        errors.print(f"[bold]stopped:[/bold] {escape(brief(str(partial)))}")
        return 3
    except KeyboardInterrupt as interrupt:
        errors.print(f"stopped by {interruption(interrupt)}")
        return 1
    except TOLD as error:
        errors.print("error:", brief(str(error)), markup=False)
        return 1
    except OSError as error:  # a folder that cannot be made or written; devices' own are DeviceErrors above
        errors.print(
            "error:", f"{error.filename or 'file'}: {error.strerror or error}; choose another --out", markup=False
        )
        return 1
    return 0
