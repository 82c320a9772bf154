"""Draws what is believed of a rig: wrong noise, perhaps no tolerances, masses or device."""

from collections.abc import Sequence

import numpy as np

from simulators.conceal.belief import Belief, KnownDistance
from simulators.conceal.recorded import ENCODER_RAD
from simulators.conceal.rig import Artefacts
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.wanted import Wanted

NOISE_KEY = {"dual-psd": "psd_m", "tracker": "position_m", "wire": "wire_m", "cones": "seat_m"}
WRONG_BY = (1.5, 8.0)  # the noise of a rig file against the true one, up or down


def believe(
    wanted: Wanted, drawn: DrawnRig, distances: Sequence[KnownDistance], sigma_m: float, rng: np.random.Generator
) -> Belief:
    """The rig file of a session whose true noise is `sigma_m`."""
    wrong = float(np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(*np.log(WRONG_BY))))
    spread = drawn.spread
    tolerance = {"length_m": spread.length_m, "angle_rad": spread.angle_rad}
    if wanted.family == "dual-psd":
        tolerance |= {"psd2_m": spread.psd2_m, "psd2_rad": spread.psd2_rad}
    noise = {NOISE_KEY[wanted.family]: sigma_m * wrong}
    if wanted.family == "cones":
        noise["joint_rad"] = ENCODER_RAD * wrong
    bars_m = drawn.true.instrument.bar_m if isinstance(drawn.true.instrument, Artefacts) else np.empty(0)
    weighed = drawn.believed.arm.tool_kg > 0.0 and bool(drawn.drawing.mass_kg)
    return Belief(
        drawing=drawn.drawing,
        rig=drawn.believed,
        tool_kg=drawn.believed.arm.tool_kg if weighed else None,
        tool_com_m=drawn.believed.arm.tool_com_m,
        device_known=bool(rng.random() < 0.5),
        distances=distances,
        bars_m=tuple(bars_m.tolist()),
        noise=noise,
        tolerance=tolerance if rng.random() < 0.6 else {},
        encoder_side="" if not wanted.side_stated else "link" if wanted.encoders == "link" else "motor",
    )
