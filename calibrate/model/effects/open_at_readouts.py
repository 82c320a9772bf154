"""Open families at instruments: fringes and bumps of a detector's face, light that bends on its way to a device."""

import numpy as np

from calibrate.errors import DataError
from calibrate.model.alignment import align
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import point_of
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.psd_terms import half_size_m, spot
from calibrate.model.effects.term import Floats, Form, Functions, Inner, Shape, Term
from calibrate.model.sensors import spots
from calibrate.model.sensors.kind import Trait

ACROSS = np.arange(-7.35, 7.4, 0.7)  # waves over the spots' range: 0.7 apart, a phase is off by 1.1 rad at the edge
LIMIT_M = 5e-3
LIMIT = 0.2  # of the spot at the edge, as psd_nonlinearity
LIMIT_PER_M = 1e-3  # bent light: 100 times the 1e-5 per metre of 10 K per metre


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    if drivers.light is not None:
        for detector in (1, 2):
            out += [_fringes(drivers, detector), _face(detector)]
    for name in drivers.having(Trait.IN_SPACE):
        out += [_bent_light(name), _squares(name)]
    return tuple(out)


def _fringes(drivers: Drivers, detector: int) -> Term:
    """Both readings wave across the face in any direction: interference in a window, strips of a worn layer."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        angle = 2.0 * np.pi * spot(drivers, detector) @ inner
        out = np.zeros((len(angle), 4, 4))
        for face in (0, 1):
            out[:, 2 * detector - 2 + face, 2 * face] = np.sin(angle)
            out[:, 2 * detector - 2 + face, 2 * face + 1] = np.cos(angle)
        return out

    seen = drivers.readouts[spots.KIND.name].seen
    reach_m = np.maximum(np.ptp(spot(drivers, detector)[seen], axis=0), 1e-6)
    along_x = tuple((ACROSS / reach_m[0]).tolist())
    along_y = tuple((ACROSS[ACROSS > 0.0] / reach_m[1]).tolist())  # the other half of the plane is the same waves
    waves = (
        Inner("waves_x_per_m", along_x, 1.1 * along_x[0], 1.1 * along_x[-1]),
        Inner("waves_y_per_m", along_y, 0.0, 1.1 * along_y[-1]),
    )
    names = tuple(f"{face}_{part}_m" for face in "xy" for part in ("sine", "cosine"))
    return _detector(detector, Shape.HARMONIC, "fringes", function, names, waves)


def _face(detector: int) -> Term:
    """Every cubic of the spot that no named bend has."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        half = half_size_m(drivers)
        x, y = (spot(drivers, detector) / half).T
        out = np.zeros((len(x), 4, 8))
        for k, product in enumerate((x**3, x**2 * y, x * y**2, y**3)):
            out[:, 2 * detector - 2, k] = out[:, 2 * detector - 1, 4 + k] = product * half
        return out

    names = tuple(f"{face}_{cube}_share" for face in "xy" for cube in ("xxx", "xxy", "xyy", "yyy"))
    return _detector(detector, Shape.CUBIC, "bent face", function, names, ())


def _detector(
    detector: int,
    shape: Shape,
    variant: str,
    function: Functions,
    names: tuple[str, ...],
    inner: tuple[Inner, ...],
) -> Term:
    return Form(
        Port(f"psd{detector}.reading", Place.READING, instrument=spots.KIND.name),
        (f"spot{detector}",),
        shape,
        "unknown",
        None,
        inner,
        variant=variant,
        open=True,
        function=function,
        names=names,
        limit=LIMIT if not inner else LIMIT_M,
        sentence=f"PSD {detector} is off by an unknown function of where the spot is",
    )


def _bent_light(name: str) -> Term:
    """Towards gravity by the square of the range: air in layers bends a beam to a circle, r^2 / 2R off its chord."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        seen, down = np.nan_to_num(drivers.readouts[name].predicted), _down(drivers, name)
        level = seen[:, :3] - np.outer(seen[:, :3] @ down, down)
        out = np.zeros((*seen.shape, 1))
        out[:, :3, 0] = 0.5 * np.sum(level**2, axis=1)[:, None] * down
        return out

    return _reading(name, Shape.QUADRATIC, "towards gravity", function, ("curvature_per_m",))


def _squares(name: str) -> Term:
    """Along each axis of the device by the square of the range."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        seen = np.nan_to_num(drivers.readouts[name].predicted)
        out = np.zeros((*seen.shape, 3))
        for axis in range(3):
            out[:, axis, axis] = 0.5 * np.sum(seen[:, :3] ** 2, axis=1)
        return out

    return _reading(name, Shape.QUADRATIC, "squares", function, tuple(f"curvature_{a}_per_m" for a in "xyz"))


def _reading(name: str, shape: Shape, variant: str, function: Functions, names: tuple[str, ...]) -> Term:
    return Form(
        Port("device.reading", Place.READING, instrument=name),
        ("reading",),
        shape,
        "unknown",
        variant=variant,
        open=True,
        function=function,
        names=names,
        limit=LIMIT_PER_M,
        sentence="The measuring device is off by an unknown function of what it reads",
    )


def _down(drivers: Drivers, name: str) -> Floats:
    """(3,) unit vector of gravity in the device's frame, from where the model sees the target in either frame."""
    seen = np.flatnonzero(drivers.of_session(drivers.readouts[name].seen))
    in_device = drivers.readouts[name].predicted[seen, :3]
    in_base = point_of(drivers, drivers.n_joints, drivers.rig.tool.point_m or (0.0, 0.0, 0.0))[seen]
    try:
        turned = align(in_device, in_base).T_a_b[:3, :3]
    except DataError:  # all places on a line: nothing says how the device stands, so no light bends
        return np.zeros(3)
    return turned @ drivers.gravity_m_s2 / max(float(np.linalg.norm(drivers.gravity_m_s2)), 1e-9)


EFFECT = Kind(
    "unknown",
    "Something in an instrument that no entry of this catalogue describes.",
    ("psd-nonlinearity", "device-scale"),
    "mismatch lesson 6: periodic in the reading with unknown period; refraction: curvature of a beam in layered air, "
    "Torge, Geodesy, 3rd ed., 2001, section 5.1",
    _terms,
)
