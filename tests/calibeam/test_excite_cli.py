"""`calibeam excite` as a person sees it."""

import re
from pathlib import Path

import pytest

from acquisition.recording.motion_plan import read_motion_plan
from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibrate.excitation import fourier

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fourier, "DRAWN", 4)
    monkeypatch.setattr(fourier, "STEPS", 4)


def test_a_motion_is_written_and_what_it_would_show_is_printed(tmp_path: Path, capsys) -> None:
    out = tmp_path / "motion.toml"
    assert run(["excite", str(RIG), "--out", str(out), "--length-s", "8", "--repeats", "2"]) == 0
    plan = read_motion_plan(out, load_rig(RIG))
    assert (plan.length_s, plan.repeats) == (8.0, 2)
    said = " ".join(capsys.readouterr().out.split())
    assert "2 repeats of 8 s, begins and ends at rest" in said
    assert re.search(r"payload: 0\.\d+ kg", said)
    assert f"calibeam session {RIG} --motion {out}" in said


def test_the_same_seed_gives_the_same_motion(tmp_path: Path) -> None:
    for name in ("one", "two"):
        assert run(["excite", str(RIG), "--out", str(tmp_path / name), "--length-s", "6", "--seed", "7"]) == 0
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_what_is_not_determined_has_no_number(tmp_path: Path, capsys) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(re.sub(r"(mass_kg|com_m) = .*\n", "", RIG.read_text(encoding="utf-8")), encoding="utf-8")
    words = ["excite", str(rig), "--out", str(tmp_path / "motion.toml"), "--length-s", "6"]
    assert run(words) == 1
    assert "give --torque-noise-nm" in " ".join(capsys.readouterr().err.split())
    assert run([*words, "--torque-noise-nm", "0.5"]) == 0
    assert "payload: – kg; lean of gravity about x and y: – and – mrad" in " ".join(capsys.readouterr().out.split())


def test_a_rig_without_home_is_refused(tmp_path: Path, capsys) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(re.sub(r"home_rad = .*\n", "", RIG.read_text(encoding="utf-8")), encoding="utf-8")
    assert run(["excite", str(rig), "--out", str(tmp_path / "motion.toml")]) == 1
    assert "[motion] has no home_rad" in " ".join(capsys.readouterr().err.split())
