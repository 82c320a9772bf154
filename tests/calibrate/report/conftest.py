"""What reports are made of: a short dual-PSD session in process, and sessions of other instruments by formulas."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Recording, Samples
from acquisition.recording.rig import parse_rig, rig_sha256, rig_text
from calibeam.results.identification import identify_session, session_model
from calibrate.diagnose.gross_errors import gross_errors_first
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.model.model_file import ModelFile, RigIdentity
from calibrate.report.evidence.session_evidence import SessionEvidence, session_evidence
from calibrate.report.session_report import session_page
from tests.support.recorded_session import recorded_session

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
POSITION, ORIENTATION = ("x_m", "y_m", "z_m"), ("rx_rad", "ry_rad", "rz_rad")
NOISE_M, NOISE_RAD = 20e-6, 1e-4


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    drawn = recorded_session(tmp_path_factory)
    hostile = rig_text(RIG).replace('name = "ur5e-dual-psd"', 'name = "<script>alert(1)</script>"')
    return replace(drawn, path=Path("r.mcap"), rig_text=hostile, rig=parse_rig(hostile, "rig"))


@pytest.fixture(scope="session")
def spots(recorded: Recording) -> SessionEvidence:
    """The dual-PSD session and its model."""
    return session_evidence(recorded, session_model(identify_session(recorded), recorded))


@pytest.fixture(scope="session")
def spots_html(spots: SessionEvidence) -> str:
    """Its whole report, made once."""
    return session_page(spots)


class ArmSession:
    """A UR5e a little beside its drawing, and what its instruments read of it; plain 4 x 4 products."""

    tool_m = np.array([0.021, -0.012, 0.083])
    turn, shift_m = Rotation.from_rotvec([0.3, -0.4, 2.2]), np.array([1.8, -0.6, 0.4])  # of the device, in the base
    mounted = Rotation.from_rotvec([0.2, 0.1, -0.3])  # a 6-D target on the flange

    def __init__(self, truth, n: int, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.q_rad = self.rng.uniform(-1.8, 1.8, (n, 6))
        self.flanges = np.array([truth.flange(q + truth.zeros) for q in self.q_rad])
        self.tips_m = (self.flanges @ np.array([*self.tool_m, 1.0]))[:, :3]

    def positions(self) -> dict[str, np.ndarray]:
        seen = self.turn.inv().apply(self.tips_m - self.shift_m)
        return dict(zip(POSITION, (seen + self.rng.normal(0.0, NOISE_M, seen.shape)).T, strict=True))

    def turns(self) -> dict[str, np.ndarray]:
        turned = self.turn.inv() * Rotation.from_matrix(self.flanges[:, :3, :3]) * self.mounted
        noise = Rotation.from_rotvec(self.rng.normal(0.0, NOISE_RAD, (len(self.q_rad), 3)))
        return dict(zip(ORIENTATION, (noise * turned).as_rotvec().T, strict=True))

    def wire(self) -> dict[str, np.ndarray]:
        length_m = np.linalg.norm(self.tips_m - self.shift_m, axis=1)
        return {"wire_m": length_m + self.rng.normal(0.0, NOISE_M, len(length_m))}

    def recording(self, columns: dict[str, np.ndarray], name: str = "any-arm") -> Recording:
        text = rig_text(RIG).replace('name = "ur5e-dual-psd"', f'name = "{name}"')
        text = text.replace("laser_origin_m", "point_m = [0.02, -0.01, 0.08]\nlaser_origin_m", 1)
        text = text.replace("[noise]", "[noise]\nposition_m = 20e-6\nwire_m = 20e-6", 1)
        readings = {f"q{i + 1}_rad": self.q_rad[:, i] for i in range(6)}
        samples = Samples({"t_s": np.arange(len(self.q_rad), dtype=float), **readings, **columns}, 6)
        return Recording(Path("session"), text, parse_rig(text, "rig"), samples, complete=True)

    def model(self, recording: Recording) -> ModelFile:
        rig = recording.rig
        found = identify(rig, recording.samples, rng=np.random.default_rng(1))
        identity = RigIdentity(rig.name, rig_sha256(recording.rig_text), recording.rig_text)
        return record_of(found, identity, rig.arm.model.value)

    def model_of_diagnosis(self, recording: Recording) -> ModelFile:
        """As of a diagnosis that has found no effect."""
        cleared = gross_errors_first(recording.rig, recording.samples)
        fit = fit_geometry(session_of(recording.rig, cleared.samples))
        return model_of_fit(fit, fit, cleared, recording, "geometry alone")


@pytest.fixture(scope="session")
def arm_session(ur5e_truth):
    """ArmSession of so many poses; a new one each time, so that its columns may be changed; joints moved since."""
    truth = ur5e_truth(np.random.default_rng(5), zero_max=5e-3)

    def made(n: int = 80, *, seed: int = 6, moved_rad: tuple[float, ...] = (0.0,) * 6) -> ArmSession:
        return ArmSession(replace(truth, zeros=truth.zeros + np.array(moved_rad)), n, seed)

    return made


@pytest.fixture(scope="session")
def wire_and_positions(arm_session):
    """Two instruments, each at half of the poses, and a name that would be code."""
    session = arm_session()
    half = np.arange(len(session.q_rad)) % 2 == 0
    columns = {name: np.where(half, column, np.nan) for name, column in session.positions().items()}
    columns |= {name: np.where(half, np.nan, column) for name, column in session.wire().items()}
    recording = session.recording(columns, "<script>alert(1)</script>")
    return recording, session.model(recording)


@pytest.fixture(scope="session")
def session_html(wire_and_positions) -> str:
    """The whole report of that session, made once."""
    return session_page(session_evidence(*wire_and_positions))
