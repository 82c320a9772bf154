"""`calibeam verify`: exit codes, JSON, and a page that needs nothing else."""

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import read, readings_sha256
from acquisition.recording.rig import load_rig, rig_sha256, rig_text
from calibeam.cli import run
from calibeam.guided.recorded import AssumedGuidedArm
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.model_file import ModelFile, RigIdentity, write_model

RIG_FILE = Path(__file__).parents[2] / "rigs" / "arm-cmm-reference.toml"
RIG = load_rig(RIG_FILE)


def perfect_model() -> ModelFile:
    """A nominal arm: all corrections are zero."""
    names = [p.name for p in with_discs(arm_of(RIG), RIG).parameters] + ["tool.x", "tool.y", "tool.z"]
    identity = RigIdentity(RIG.name, rig_sha256(rig_text(RIG_FILE)), rig_text(RIG_FILE))
    return ModelFile(
        1, "calibeam-model", "test", identity, "local-poe", "CONVERGED", "", 10, 1, 1, None, (), (), (),
        dict.fromkeys(names, 0.0), None, {}, None, None, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


def session(folder: Path, off_m: float) -> Path:
    """A cone in ten postures of the drawn arm, every second one off; and a bar that is as long as it should be."""
    arm, rng = AssumedGuidedArm.of_rig(RIG), np.random.default_rng(1)

    def postures(point_m, count):
        starts = rng.uniform(arm.lower_rad, arm.upper_rad, (200, 6))
        return arm.postures(starts, np.array(point_m))[:count]

    cone = np.array([0.5, 0.1, 0.2])
    rows = [(postures(np.add(cone, [off_m * (k % 2), 0.0, 0.0]), 1)[0], "1,,") for k in range(10)]
    rows += [
        (postures((0.5, -0.3, 0.2), 1)[0], ",1,a"),
        (postures((0.5, RIG.bars[1].length_m - 0.3, 0.2), 1)[0], ",1,b"),
    ]
    folder.mkdir()
    (folder / "rig.toml").write_text(rig_text(RIG_FILE))
    header = "t_s," + ",".join(f"q{i}_rad" for i in range(1, 7)) + ",seat,bar,bar_end"
    lines = [f"{k},{','.join(map(repr, map(float, q)))},{what}" for k, (q, what) in enumerate(rows)]
    (folder / "samples.csv").write_text("\n".join([header, *lines]) + "\n")
    return folder


@pytest.fixture
def model(tmp_path: Path) -> Path:
    write_model(tmp_path / "model.json", perfect_model())
    return tmp_path / "model.json"


def verified(folder: Path, model: Path, *more: str) -> tuple[int, dict]:
    out, page = model.with_name("verification.json"), model.with_name("verification.html")
    code = run(["verify", str(folder), "--model", str(model), "--out", str(out), "--report", str(page), *more])
    return code, json.loads(out.read_text())


def test_an_arm_within_its_limits_conforms(tmp_path: Path, model: Path) -> None:
    code, said = verified(session(tmp_path / "good", 20e-6), model)
    assert code == 0
    assert said["conforms"]
    figures = {figure["symbol"]: figure for figure in said["figures"]}
    assert figures["L_Dia at a seat"]["value_m"] == pytest.approx(20e-6, rel=0.2)
    assert figures["E_Uni"]["complete"] is False
    assert figures["P_Size"]["judgement"] == "NOT_MEASURED"


def test_an_arm_beyond_a_limit_fails_by_exit_code_and_all_is_written(tmp_path: Path, model: Path, capsys) -> None:
    code, said = verified(session(tmp_path / "bad", 200e-6), model)
    assert code == 1
    assert said["conforms"] is False
    assert "Does not conform: L_Dia at a seat, single point (2 s)" in capsys.readouterr().err.replace("\n", " ")
    page = model.with_name("verification.html").read_text()
    assert "DOES NOT CONFORM" in page
    assert "src=" not in page
    assert 'href="http' not in page


def test_a_model_of_another_arm_or_of_these_very_readings_is_refused(tmp_path: Path, capsys) -> None:
    folder, path = session(tmp_path / "good", 0.0), tmp_path / "model.json"
    own, text = perfect_model(), rig_text(RIG_FILE)
    drawn = own.rig.text.replace("origin_m = [0.0, 0.0, 0.475]", "origin_m = [0.0, 0.0, 0.476]")
    for wrong, says in (
        (msgspec.structs.replace(own, rig=RigIdentity("other-arm", "", text)), "give the model of this arm"),
        (msgspec.structs.replace(own, rig=RigIdentity(RIG.name, "", drawn)), "joint 6 of the model's rig file is not"),
        (msgspec.structs.replace(own, readings_sha256=readings_sha256(read(folder).samples)), "these very readings"),
    ):
        write_model(path, wrong)
        assert run(["verify", str(folder), "--model", str(path), "--out", str(tmp_path / "v.json")]) == 1
        assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "v.json").exists()


def test_other_measurements_at_the_joint_angles_of_the_fit_are_verified(tmp_path: Path, capsys) -> None:
    folder, path = session(tmp_path / "good", 0.0), tmp_path / "model.json"
    table = (folder / "samples.csv").read_text().splitlines()
    (folder / "samples.csv").write_text("\n".join(f"{row},{'wire_m' if k == 0 else k}" for k, row in enumerate(table)))
    older = msgspec.structs.replace(perfect_model(), readings_sha256=readings_sha256(read(folder).samples))
    for measured, says in ((None, True), ("0" * 64, False)):
        write_model(path, msgspec.structs.replace(older, measured_sha256=measured))
        assert verified(folder, path)[0] == 0
        assert ("at the same joint angles" in " ".join(capsys.readouterr().out.split())) == says


def test_json_is_one_object_and_nothing_else(tmp_path: Path, model: Path, capsys) -> None:
    verified(session(tmp_path / "good", 0.0), model, "--json")
    assert json.loads(capsys.readouterr().out)["kind"] == "calibeam-verification"


def test_a_session_without_artefacts_is_reported(tmp_path: Path, model: Path, capsys) -> None:
    folder = session(tmp_path / "none", 0.0)
    text = (folder / "samples.csv").read_text().splitlines()
    (folder / "samples.csv").write_text("\n".join(line.rsplit(",", 3)[0] for line in text) + "\n")
    assert run(["verify", str(folder), "--model", str(model)]) == 1
    assert "nothing to verify by" in capsys.readouterr().err.replace("\n", " ")
