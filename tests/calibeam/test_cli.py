"""The command line: exit codes, and one clear sentence for everything that is wrong with the user's world."""

from collections.abc import Callable
from pathlib import Path

import pytest

from calibeam.cli import run
from calibeam.emulation import Emulation

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture
def rig_with(tmp_path: Path) -> Callable[..., Path]:
    """The shipped rig with pieces of its text replaced."""

    def made(*pairs: tuple[str, str]) -> Path:
        text = RIG.read_text()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return path

    return made


@pytest.fixture
def session_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[[Path], tuple[int, str]]:
    def ran(rig: Path) -> tuple[int, str]:
        code = run(["session", str(rig), "--out", str(tmp_path / "out")])
        return code, " ".join(capsys.readouterr().err.split())

    return ran


def test_help_is_good_and_an_unknown_command_is_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    assert "identify" in capsys.readouterr().out
    assert run(["calibrateeverything"]) == 2


@pytest.mark.parametrize("command", ["demo", "session", "emulate", "identify", "report", "export", "import"])
def test_every_command_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    assert f"Example: calibeam {command}" in " ".join(capsys.readouterr().out.split())


def test_a_misspelt_key_names_line_and_nearest_key(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("speed_rad_s =", "sped_rad_s =")))
    assert code == 1
    assert "rig.toml line" in said
    assert "speed_rad_s" in said


def test_a_wrong_unit_is_refused(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("d_m = 0.1625", 'd_m = "9.3 deg"')))
    assert code == 1
    assert "d_m" in said


def test_a_missing_port_is_named(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("out/emulated/psd", "no/such/port")))
    assert code == 1
    assert "no/such/port" in said


def test_no_controller_at_the_address_is_named(rig_with, session_of) -> None:
    with Emulation(RIG, seed=1) as emulation:
        psd, can = emulation.address["psd"]["port"], emulation.address["can"]["channel"]
        changed = rig_with(
            ("out/emulated/psd", psd), ("out/emulated/can", can), ('host = "127.0.0.2"', 'host = "127.255.0.9"')
        )
        code, said = session_of(changed)
    assert code == 1
    assert "127.255.0.9" in said


def test_the_wrong_device_on_the_port_is_told_apart(rig_with, session_of) -> None:
    with Emulation(RIG, seed=1) as emulation:
        code, said = session_of(rig_with(("out/emulated/psd", emulation.address["can"]["channel"])))
    assert code == 1
    assert "not a PSD box" in said


def test_a_busy_port_is_named(rig_with, session_of) -> None:
    from drivers.psd_daq.device import BAUD
    from drivers.transports.serial_port import SerialAddress, open_serial

    with Emulation(RIG, seed=1) as emulation:
        port = emulation.address["psd"]["port"]
        line = open_serial(SerialAddress(port=port), BAUD)
        try:
            code, said = session_of(rig_with(("out/emulated/psd", port)))
        finally:
            line.close()
    assert code == 1
    assert port in said


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"not a recording")
    assert run(["identify", str(path)]) == 1
    assert "x.mcap" in capsys.readouterr().err
