"""A whole session in the moving world, mechanism at work: it finds its spots, and they are those of the fast path."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import RecordingWriter
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from drivers.clock import SystemClock
from simulators.conceal.observe import observe
from simulators.conceal.on_wire import Taken, draw_wired, taken_case
from simulators.conceal.wanted import Wanted
from simulators.world.world import World
from tests.support.direct_bench import DirectBench

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"


@pytest.mark.timeout(300)
@pytest.mark.parametrize(
    ("mechanism", "off_centre"),
    [
        ("soft-joint", 1),
        *(pytest.param(one, 3, marks=pytest.mark.endure) for one in ("soft-joint", "encoder-eccentricity")),
    ],
)
def test_the_spots_of_a_session_are_those_of_the_fast_path_within_noise(
    mechanism: str, off_centre: int, tmp_path: Path
) -> None:
    rig, clock = load_rig(RIG), SystemClock()
    assert rig.fixture is not None
    wanted = Wanted("dual-psd", seed=31, defects=(mechanism,), enr=5.0, samples=16, places=1)
    wired = draw_wired(wanted, tomllib.loads(RIG.read_text()))
    hidden = [one.defect for one in wired.hidden]
    world = World.from_rig(wired.emulated, seed=wanted.seed, q_rad=rig.motion.home_rad, hidden=hidden)
    with RecordingWriter(tmp_path / "r.mcap", rig_text=rig_text(RIG), software="test", clock=clock) as writer:
        plan = PlanOptions(centred=1, off_centre=off_centre, repeats=1)
        bench = DirectBench(world, rig.fixture.half_size_m)
        home_rad = np.array(rig.motion.home_rad)
        session = Session(bench, FittedLearner(rig), RecordingJournal(writer, clock), plan, home_rad)
        samples = session.run((1,)).samples
    assert len(samples) == 2 * (1 + off_centre + 2)  # in both orders; one pose twice more
    case = taken_case(
        wired,
        Taken(
            t_s=np.array([s.look.t_s for s in samples]),
            power_on_s=0.0,
            reading_rad=np.array([s.look.q_rad for s in samples]),
            approach=np.array([s.approach for s in samples], dtype=float),
            placement=np.array([s.placement for s in samples]),
            first_psd=np.array([s.first for s in samples]),
            repeat=np.array([s.repeat or 0 for s in samples]),
            spots_m=np.array([s.look.spots_m() for s in samples]),
        ),
    )
    rms_m = float(np.sqrt(np.mean((case.values_m - case.exact.values_m) ** 2)))
    assert rms_m < 2.0 * case.sigma_m  # gears that seat anew, 200 readings averaged
    stiff = observe(case.drawn.true, case.table.scene, (), case.posture_rad)
    assert np.sqrt(np.mean((case.values_m - stiff.values_m) ** 2)) > 5.0 * rms_m  # so what is hidden was at work
    assert case.hidden[0].enr > 0.0
