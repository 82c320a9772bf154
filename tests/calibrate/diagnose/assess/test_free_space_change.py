"""What a cause does over the workspace, and how well that is known."""

import numpy as np

from calibrate.diagnose.assess.free_space_change import free_space_change
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from tests.calibrate.diagnose.concealed import recording_of


def test_uncertainty_about_the_frames_of_base_and_tool_is_no_uncertainty_about_the_arm(tmp_path):
    """No tolerance says where they are; a cause at a joint must not bring that into the arm's error."""
    wanted = {"seed": 903, "samples": 160, "defects": ("encoder-eccentricity",), "enr": 1.5}
    recording = recording_of(tmp_path, family="tracker", **wanted)
    assert recording.rig.tolerance is None
    geometry = fit_geometry(session_of(recording.rig, recording.samples))
    bench = Bench(geometry)
    term = next(t for t in bench.menu.terms if (t.port.where, t.physics) == ("joint3.angle", "encoder-eccentricity"))
    model = geometry.refitted([refined(bench, term, np.zeros(0))])
    alone, found = (free_space_change(geometry, one, np.random.default_rng(2)) for one in (geometry, model))
    assert found is not None
    assert alone is not None
    assert found.after_m < 1.5 * alone.after_m
    assert found.before_m > 2.0 * found.after_m
