"""All commands in the groups in which `calibeam --help` lists them: name, where the function is, one sentence.

The sentence is the first line of the command's docstring. It is repeated here, and a test compares the two, because
the list would otherwise import every command: three seconds before the first line of help.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class ListedCommand:
    """One line of the list; `place` is `module:function` below calibeam.commands."""

    name: str
    place: str
    summary: str


GROUPS: dict[str, tuple[ListedCommand, ...]] = {
    "Start here": (
        ListedCommand("rig", "rig:rig_command", "Write the rig file of a robot, or list the robots that are shipped."),
        ListedCommand("import", "import_files:import_command", "Make a session of a table, a log or a session folder."),
        ListedCommand("demo", "demo:demo", "Run a whole session on emulated devices and show the truth."),
        ListedCommand("session", "session:session", "Run a session: check, plan, align, centre, measure, report."),
        ListedCommand("check", "check:check_command", "Check every device of a rig, or check a recording; no motion."),
    ),
    "On site": (
        ListedCommand("live", "live:live_command", "Show a rig's devices live in the browser, with a STOP button."),
        ListedCommand("move", "move:move_command", "Move the arm to a pose: planned, shown, confirmed, then executed."),
        ListedCommand("jog", "jog:jog_command", "Step one joint, or move the flange along an axis, slowly."),
        ListedCommand("task", "task:task_command", "Teach a task by placing the arm, or run its program."),
        ListedCommand("centre", "centre:centre_command", "Centre the beam once, from where the arm stands."),
        ListedCommand("camera", "camera:camera_command", "Calibrate the camera with a tour of the arm round a board."),
        ListedCommand("psd-check", "psd_check:psd_check_command", "Check a detector against known spot positions."),
        ListedCommand("log", "log:log", "Log the encoders, or the tracker, until Ctrl-C."),
    ),
    "Calibrate": (
        ListedCommand(
            "calibrate",
            "calibrate:calibrate_command",
            "Calibrate the arm from a recording: identify, diagnose, prove, report.",
        ),
        ListedCommand("design", "design:design_command", "Choose the poses of a session before it is run."),
        ListedCommand("excite", "excite:excite_command", "Design a motion that shows the torques of all joints."),
        ListedCommand("identify", "identify:identify_command", "Identify the arm's geometry from a recording."),
        ListedCommand("diagnose", "diagnose:diagnose_command", "Find the physics that the geometric model leaves out."),
        ListedCommand(
            "predict", "predict:predict_command", "Predict readings with a model, each with its uncertainty."
        ),
        ListedCommand(
            "correct", "correct:correct_command", "Correct poses or a program, so that the real tool reaches them."
        ),
        ListedCommand(
            "report", "report:report_command", "Write the report of a recording: one self-contained HTML file."
        ),
        ListedCommand(
            "tool-axes", "tool_axes:tool_axes_command", "Locate the target on the flange by single-axis turns."
        ),
        ListedCommand("verify", "verify:verify_command", "Verify a measuring arm by spheres, cones and length bars."),
        ListedCommand("iso9283", "iso9283:iso9283", "Plan a pose test to ISO 9283, or evaluate a recording of one."),
        ListedCommand("batch", "batch:batch_command", "Identify every recording below a folder; table and drift page."),
    ),
    "Simulation": (
        ListedCommand("emulate", "emulate:emulate", "Emulate every device of a rig on real wires until Ctrl-C."),
        ListedCommand(
            "replay",
            "replay:replay_command",
            "Move a simulated rig through a recording's motion, with a model's physics.",
        ),
        ListedCommand("compare", "compare:compare_command", "Find where a simulation and a measurement disagree."),
        ListedCommand("reconcile", "reconcile:reconcile_command", "Bring a simulation to agree with a recording."),
        ListedCommand("motion", "motion:motion_command", "Run the motion examples on an emulated controller."),
        ListedCommand(
            "simulate-errors", "simulate_errors:simulate_errors_command", "Propagate an arm's errors to its tool."
        ),
        ListedCommand("prove", "prove:prove_command", "Test the diagnosis on sessions with hidden physics."),
    ),
    "Files": (
        ListedCommand(
            "export", "export:export_command", "Write a recording as tables, or its CAN frames as a CAN log."
        ),
        ListedCommand(
            "export-model",
            "export_model:export_model_command",
            "Export a model to another program, or to its controller.",
        ),
        ListedCommand("recover", "recover:recover_command", "Save what is readable of a damaged recording."),
    ),
}

COMMANDS = {command.name: command.place for group in GROUPS.values() for command in group}
