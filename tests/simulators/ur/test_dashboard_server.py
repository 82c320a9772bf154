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


def test_a_protective_stop_refuses_the_unlock_as_long_as_it_was_told_to(bench) -> None:
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
