import pytest

BANNER = b"Connected: Universal Robots Dashboard Server\n"


def ask(bench, line: str) -> str:
    wire = bench.controller.dashboard.accept()
    assert wire.due() == BANNER
    return wire.handle(f"{line}\n".encode()).decode().removesuffix("\n")


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("PolyscopeVersion", "URSoftware 5.12.0.1101 (Mar 01 2022)"),
        ("get serial number", "20195000001"),
        ("get robot model", "UR5"),
        ("is in remote control", "true"),
        ("ROBOTMODE", "Robotmode: RUNNING"),
        ("safetymode", "Safetymode: NORMAL"),
        ("safetystatus", "Safetystatus: NORMAL"),
        ("running", "Program running: false"),
        ("stop", "Stopped"),
        ("close safety popup", "closing safety popup"),
        ("popup look here", "showing popup"),
        ("load demo.urp", "File not found: demo.urp"),
        ("load installation default.installation", "File not found: default.installation"),
        ("get loaded program", "No program loaded"),
        ("isProgramSaved", "false <unnamed>"),
        ("programState", "STOPPED <unnamed>"),
        ("play", "Failed to execute: play"),
        ("pause", "Failed to execute: pause"),
        ("get operational mode", "NONE"),
        ("set operational mode resting", "Failed setting operational mode: resting"),
        ("getUserRole", "NONE"),
        ("setUserRole king", "Failed setting user role: king"),
        ("saveLog", "Log saved to disk"),
        ("addToLog a line", "Added log message"),
        ("generate flight report", "Error: no flight report was recorded"),
        ("generate support file /tmp", "Error: no support file can be written to /tmp"),
        ("restart safety", "Restarting safety"),
        ("make coffee", "could not understand: 'make coffee'"),
    ],
)
def test_replies(bench, line: str, reply: str) -> None:
    assert ask(bench, line) == reply


def test_the_way_from_power_off_to_running(bench) -> None:
    assert ask(bench, "power off") == "Powering off"
    assert ask(bench, "robotmode") == "Robotmode: POWER_OFF"
    assert ask(bench, "power on") == "Powering on"
    bench.run(2.0)
    assert ask(bench, "robotmode") == "Robotmode: IDLE"
    assert ask(bench, "brake release") == "Brake releasing"
    bench.run(1.0)
    assert ask(bench, "robotmode") == "Robotmode: RUNNING"


def test_a_protective_stop_refuses_the_unlock_as_long_as_it_was_asked_to(bench) -> None:
    bench.arm.power.unlock_delay_s = 5.0
    bench.run(0.1)
    bench.arm.protective_stop()
    assert ask(bench, "safetystatus") == "Safetystatus: PROTECTIVE_STOP"
    bench.run(4.0)
    assert ask(bench, "unlock protective stop").startswith("Cannot unlock protective stop until 5s")
    bench.run(1.5)
    assert ask(bench, "unlock protective stop") == "Protective stop releasing"
    assert ask(bench, "safetystatus") == "Safetystatus: NORMAL"


def test_lines_come_in_any_split_and_quit_ends_the_connection(bench) -> None:
    wire = bench.controller.dashboard.accept()
    assert wire.handle(b"robot") == BANNER
    assert wire.handle(b"mode\nqu") == b"Robotmode: RUNNING\n"
    assert not wire.closing
    assert wire.handle(b"it\n") == b"Disconnected\n"
    assert wire.closing


def test_pause_holds_the_arm_on_its_path_and_play_goes_on(bench) -> None:
    bench.controller.script_wire().handle(b"movej([1.0, -1.5, 1.5, -1.5, -1.5, 0.0], a=3.0, v=0.5)\n")
    bench.run(1.0)
    assert ask(bench, "pause") == "Pausing program"
    bench.run(1.0)
    held = bench.world.joints().q_rad[0]
    bench.run(1.0)
    assert bench.world.joints().q_rad[0] == held < 1.0
    assert ask(bench, "play") == "Starting program"
    bench.settle()
    assert bench.world.joints().q_rad[0] == 1.0


def test_a_stored_program_is_loaded_played_paused_and_stopped(bench) -> None:
    programs = bench.controller.dashboard.programs
    programs["turn.urp"] = "def turn():\n  movej([1.0, -1.5, 1.5, -1.5, -1.5, 0.0], a=3.0, v=0.5)\nend\n"
    assert ask(bench, "load turn.urp") == "Loading program: /programs/turn.urp"
    assert ask(bench, "get loaded program") == "Loaded program: /programs/turn.urp"
    assert ask(bench, "isProgramSaved") == "true turn.urp"
    assert ask(bench, "programState") == "STOPPED turn.urp"
    assert ask(bench, "play") == "Starting program"
    assert ask(bench, "programState") == "PLAYING turn.urp"  # answered when it runs
    bench.run(1.0)
    assert ask(bench, "pause") == "Pausing program"
    assert ask(bench, "programState") == "PAUSED turn.urp"
    assert ask(bench, "play") == "Starting program"
    bench.run_until(lambda: ask(bench, "running") == "Program running: false", 10.0)
    assert bench.world.joints().q_rad[0] == 1.0
    assert ask(bench, "load /programs/turn.urp") == "Loading program: /programs/turn.urp"
    assert ask(bench, "play") == "Starting program"
    assert ask(bench, "play") == "Failed to execute: play"  # it runs already
    assert ask(bench, "stop") == "Stopped"
    assert ask(bench, "running") == "Program running: false"


def test_a_program_that_cannot_run_is_not_loaded(bench) -> None:
    bench.controller.dashboard.programs["loop.urp"] = "def loop():\n  while True:\n    sync()\n  end\nend\n"
    assert ask(bench, "load loop.urp") == "Error while loading program: loop.urp"
    assert "while True:" in bench.controller.runner.last_error
    assert ask(bench, "play") == "Failed to execute: play"


def test_nothing_plays_while_the_arm_may_not_move(bench) -> None:
    bench.controller.dashboard.programs["rest.urp"] = "sleep(1)"
    ask(bench, "load rest.urp")
    bench.arm.protective_stop()
    assert ask(bench, "play") == "Failed to execute: play"
    ask(bench, "unlock protective stop")
    assert ask(bench, "play") == "Starting program"


def test_mode_and_role_are_kept(bench) -> None:
    assert ask(bench, "set operational mode automatic") == "Setting operational mode: AUTOMATIC"
    assert ask(bench, "get operational mode") == "AUTOMATIC"
    ask(bench, "clear operational mode")
    assert ask(bench, "get operational mode") == "NONE"
    assert ask(bench, "setUserRole operator") == "Setting user role: OPERATOR"
    assert ask(bench, "getUserRole") == "OPERATOR"


def test_the_reported_version_is_one_that_can_be_imitated(bench) -> None:
    bench.controller.report_version((5, 23, 0, 7))
    assert ask(bench, "PolyscopeVersion") == "URSoftware 5.23.0.7 (Mar 01 2022)"
    assert ask(bench, "version") == "5.23.0.7"
    for version in ((5, 9, 0, 0), (5, 26, 0, 0), (10, 12, 0, 0)):
        with pytest.raises(ValueError, match=r"5\.10 to 5\.25 can be imitated"):
            bench.controller.report_version(version)
