"""Open families at frames: base and links that tilt with a joint in a way of their own (cable, hose)."""

import numpy as np

from calibrate.model.effects.curves import SPLINES, centred, splines
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Functions, Shape, Term
from calibrate.model.effects.time_laws import varies

LIMIT_RAD = 5e-2
TURNS = np.eye(6)[:, 3:]  # of a body twist


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        if not varies(drivers.q_rad[:, joint - 1]):
            continue
        port = Port("base.pose" if joint == 1 else f"link{joint - 1}.tilt", Place.FRAME, joint - 1)
        what = "The base" if joint == 1 else f"Link {joint - 1}"
        out += [
            *(_leaning(port, what, joint, most) for most in (1, 3)),
            _winding(port, what, joint),
            _tilting(port, what, joint),
        ]
    return tuple(out)


def _leaning(port: Port, what: str, joint: int, most: int) -> Term:
    """Turns about axes at rest in front of the joint, by powers of its angle to `most`: a hose, a spring."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        x = centred(drivers, drivers.q_rad[:, joint - 1])
        return np.stack([x**power for power in range(1, most + 1)], axis=1)

    names = tuple(f"turn_{axis}_c{power}_rad" for power in range(1, most + 1) for axis in "xyz")
    shape = Shape.LINEAR if most == 1 else Shape.CUBIC
    return _open(port, what, joint, shape, "lean", function, TURNS, names)


def _winding(port: Port, what: str, joint: int) -> Term:
    """As leaning, but what pulls goes round with the joint: a chain or cable that winds up."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        q = drivers.q_rad[:, joint - 1]
        grown = centred(drivers, q)[:, None, None]
        c, s, none = np.cos(q), np.sin(q), np.zeros_like(q)
        turned = [np.stack(row, axis=1) for row in ((c, -s, none), (s, c, none), (none, none, none + 1.0))]
        out = np.zeros((len(q), 6, 3))
        out[:, 3:] = np.stack(turned, axis=1)
        return grown * out

    names = ("turn_u_rad", "turn_v_rad", "turn_w_rad")
    return _open(port, what, joint, Shape.PRODUCT, "winding lean", function, None, names)


def _tilting(port: Port, what: str, joint: int) -> Term:
    """Two tilts across the axis of the joint, each by any smooth function of its angle."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return splines(drivers, drivers.q_rad[:, joint - 1])

    names = tuple(f"tilt_c{k}_{axis}_rad" for k in range(1, SPLINES + 1) for axis in "xy")
    return _open(port, what, joint, Shape.SMOOTH, "tilt", function, TURNS[:, :2], names)


def _open(
    port: Port,
    what: str,
    joint: int,
    shape: Shape,
    variant: str,
    function: Functions,
    directions: Floats | None,
    names: tuple[str, ...],
) -> Term:
    return Form(
        port,
        (f"q{joint}",),
        shape,
        "unknown",
        variant=variant,
        open=True,
        function=function,
        names=names,
        limit=LIMIT_RAD,
        sentence=f"{what} tilts by an unknown function of q{joint}",
        directions=directions,
    )


EFFECT = Kind(
    "unknown",
    "Something pulls or props a link as a joint turns, and no entry of this catalogue describes it.",
    ("axis-wobble",),
    "mismatch catalogue: unknown f(anything) at any port",
    _terms,
)
