"""`calibeam replay`: the simulated rig of a model reads what the model predicts, and its recording is a recording."""

import json
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording import Recording, Samples, read, readings_sha256
from acquisition.recording.rig.schema import Follows
from calibeam.commands.replay import replay_command
from calibeam.simulation.physics import names_of
from calibeam.simulation.replayed_recording import replay, write_replayed
from calibeam.simulation.rig_in_numbers import arm_in_numbers
from calibrate.apply.predicting import predict_with_physics
from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord, SessionRecord
from calibrate.model.model_file import ModelFile, RigIdentity, write_model
from calibrate.model.predict import Predictor
from tests.calibeam.simulation.test_mechanism_laws import Bench, bench

DEMO = Path("tests/golden/data/demo.mcap")
FAMILIES = ("dual-psd", "tracker", "wire")
MARGIN = 0.02  # of an effect: what a mechanism may differ by


def effect(name: str, **fields: object) -> EffectRecord:
    """A linear effect of one coefficient."""
    usual = {
        "name": name,
        "shape": "linear",
        "order": None,
        "variant": "",
        "parameters": {},
        "inner": {},
        "about": {},
        "holds": "always",
        "range": {},
    }
    return EffectRecord(**{**usual, **fields})  # type: ignore[arg-type]


SOFT = effect(
    "joint2-compliance",
    where="joint2.angle",
    physics="joint-compliance",
    depends_on="gravity_torque2",
    coefficients={"joint2-compliance.c0": 8e-6},
)
WARM = effect(
    "link2-thermal-growth",
    where="link2.length",
    physics="link-thermal-growth",
    depends_on="temp_room",
    coefficients={"link2-thermal-growth.c0": 23e-6},
)
SLIPPED = effect(
    "joint3-encoder-slip",
    where="joint3.angle",
    physics="encoder-slip",
    depends_on="t",
    shape="step",
    coefficients={"joint3-encoder-slip.c0": 2e-4},
    inner={"time_s": 300.0},
    holds="session",
)


def model_of(place: Bench, *effects: EffectRecord) -> ModelFile:
    """The geometry of a session with these effects, as a diagnosis would have found them."""
    samples, rig = place.samples, place.predictor.rig
    kept = {c: tuple(v.tolist()) for c, v in samples.columns.items() if c[0] in "qtp" and c[-1] != "m"}
    kept |= {name: tuple(place.samples.column(name).tolist()) for name in ("placement", "first_psd") if name in samples}
    degC = {f"temp_{where}_degC": tuple(v.tolist()) for where, v in place.drivers.temperatures_degC.items()}
    t_s = samples.column("t_s")
    sha = readings_sha256(samples)
    return ModelFile(
        schema=2,
        kind="calibeam-model",
        software="test",
        rig=RigIdentity(rig.name, "", place.rig_text),
        arm_model=rig.arm.model.value,
        status="CONVERGED",
        says="",
        poses=len(samples),
        rank=0,
        free=0,
        condition=None,
        singular_values=(),
        unseen=(),
        parameters=(),
        chain=dict(place.predictor.values),
        covariance=None,
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=0.0,
        rms_coordinate_after_m=0.0,
        rms_distance_before_m=0.0,
        rms_distance_after_m=0.0,
        instruments=place.predictor.instruments,
        about=dict(place.predictor.about),
        readings_sha256=sha,
        effects=effects,
        needs=tuple(name for name in degC if any(e.depends_on == "temp_room" for e in effects)),
        session=SessionRecord("", float(t_s.min()), float(t_s.max()), sha, {**kept, **degC}),
    )


def recording_of(place: Bench) -> Recording:
    return Recording(Path("session.mcap"), place.rig_text, place.predictor.rig, place.samples, True)


def predicted(model: ModelFile, samples: Samples) -> dict[str, np.ndarray]:
    found = predict_with_physics(model, samples, True).columns
    return {name: values for name, values in found.items() if name in samples and name != "t_s"}


@pytest.mark.parametrize("family", FAMILIES)
def test_without_noise_it_reads_what_the_model_predicts(family: str) -> None:
    place = bench(family)  # type: ignore[arg-type]
    model = model_of(place, SOFT, WARM, SLIPPED)
    found = replay(recording_of(place), model, noisy=False)
    stiff = replay(recording_of(place), model, noisy=False, without=names_of(model))
    assert found.same_recording
    assert [name for name, _ in found.physics.named] == [
        "joint2-compliance",
        "link2-thermal-growth",
        "joint3-encoder-slip",
    ]
    assert not stiff.physics.named
    for name, values in predicted(model, place.samples).items():
        by_physics = found.samples.column(name) - stiff.samples.column(name)
        assert np.std(by_physics) > 1e-6
        np.testing.assert_allclose(found.samples.column(name), values, rtol=0.0, atol=MARGIN * np.abs(by_physics).max())


@pytest.mark.parametrize("family", FAMILIES)
def test_geometry_alone_is_the_model_to_the_last_digits(family: str) -> None:
    place = bench(family)  # type: ignore[arg-type]
    model = model_of(place)
    found = replay(recording_of(place), model, noisy=False)
    for name, values in predicted(model, place.samples).items():
        np.testing.assert_allclose(found.samples.column(name), values, rtol=0.0, atol=1e-10)


def test_a_probe_in_a_cone_shows_in_the_joint_angles() -> None:
    place = bench("cones")
    slip = structs.replace(SLIPPED, coefficients={"joint3-encoder-slip.c0": 2e-4})
    model = model_of(place, slip)
    found = replay(recording_of(place), model, noisy=False)
    moved = found.samples.joints() - place.samples.joints()
    late = place.samples.column("t_s") - place.samples.column("t_s").min() > 300.0
    tips = place.predictor.tip_m(found.samples.joints() + np.where(late[:, None], 2e-4 * np.eye(6)[2], 0.0))
    assert np.abs(tips - place.rig.seat_m)[np.isfinite(place.rig.seat_m).all(axis=1)].max() < 1e-9  # type: ignore[operator]
    assert np.abs(moved).max() > 1e-5


def test_another_recording_leaves_out_what_was_true_of_the_session_only() -> None:
    place = bench("tracker")
    left = structs.replace(SLIPPED, name="joint3-encoder-slip-after", after="joint3-encoder-slip", holds="always")
    model = structs.replace(model_of(place, SOFT, SLIPPED, left), readings_sha256="0" * 64)
    found = replay(recording_of(place), model, noisy=False)
    assert not found.same_recording
    names = [name for name, _ in found.physics.named]
    assert names == ["joint2-compliance", "joint3-encoder-slip"]
    assert any("joint3-encoder-slip" in note and "what it left behind" in note for note in found.notes)
    slipped = place.predictor.tip_m(place.samples.joints())
    assert len(slipped) == len(place.samples)
    t_s = place.samples.column("t_s")
    early = t_s < t_s.min() + 200.0
    plain = replay(recording_of(place), model, noisy=False, without=["joint3-encoder-slip"])
    apart = np.abs(found.samples.column("x_m") - plain.samples.column("x_m"))
    assert apart[early].max() > 1e-6


def test_a_wrong_name_lists_the_effects() -> None:
    place = bench("tracker")
    with pytest.raises(DataError, match=r"joint9-spring.*it has joint2-compliance, link2-thermal-growth"):
        replay(recording_of(place), model_of(place, SOFT, WARM), without=["joint9-spring"])


def test_noise_is_as_stated_and_repeats_with_its_seed() -> None:
    place = bench("tracker")
    model, source = model_of(place), recording_of(place)
    one, again, other = (replay(source, model, seed=seed) for seed in (3, 3, 4))
    stated = place.predictor.rig.noise.position_m
    noise = np.stack([one.samples.column(c) - one.exact.column(c) for c in ("x_m", "y_m", "z_m")])
    assert stated is not None
    assert noise.std() == pytest.approx(np.hypot(stated, 0.0), rel=0.15)
    np.testing.assert_array_equal(one.samples.column("x_m"), again.samples.column("x_m"))
    assert np.abs(one.samples.column("x_m") - other.samples.column("x_m")).max() > 0.0


def test_noise_as_found_goes_before_what_is_stated() -> None:
    place = bench("tracker")
    model = structs.replace(model_of(place), noise=dict.fromkeys(("x_m", "y_m", "z_m"), 3e-6))
    found = replay(recording_of(place), model, noise_found=True)
    drawn = np.stack([found.samples.column(c) - found.exact.column(c) for c in ("x_m", "y_m", "z_m")])
    assert drawn.std() == pytest.approx(3e-6, rel=0.15)


def test_what_is_written_reads_as_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = bench("tracker")
    write_replayed(tmp_path / "source.mcap", replay(recording_of(place), model_of(place)), recording_of(place), {})
    write_model(tmp_path / "model.json", model_of(place, SOFT))
    replay_command(
        tmp_path / "source.mcap",
        model=tmp_path / "model.json",
        out=tmp_path / "stiff.mcap",
        without=("joint2-compliance",),
        json=True,
    )
    said = json.loads(capsys.readouterr().out)
    assert said["effects"] == []
    (note,) = said["notes"]
    assert note.startswith("left out as asked: joint2-compliance, ")
    assert note.endswith(" rad rms")
    written = read(tmp_path / "stiff.mcap")
    assert written.rig_text == place.rig_text
    assert written.notes["without"] == "joint2-compliance"
    assert written.samples.names == place.samples.names


def test_a_coupled_arm_is_refused():
    """The simulators would turn joint 3 by the controller's number."""
    recording = read(DEMO)
    joints = list(recording.rig.arm.joints)
    joints[2] = structs.replace(joints[2], follows=Follows(2, 1.0))
    rig = structs.replace(recording.rig, arm=structs.replace(recording.rig.arm, joints=tuple(joints)))
    with pytest.raises(DataError, match="joint 3 follows joint 2"):
        arm_in_numbers(Predictor(rig, {}, {}, ()))
