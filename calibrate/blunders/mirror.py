"""A measuring device whose axes are left-handed in the file: one axis has the wrong sign, or two are exchanged."""

from collections.abc import Iterator

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.hypothesis import Hypothesis


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """Positions that only a mirror image of the arm explains (determinant -1). Which axis it is cannot be told."""
    del n_joints  # the joints are as written
    yield Hypothesis(
        BlunderKind.MIRRORED_AXIS,
        "columns x_m, y_m, z_m",
        "the frame between arm and device has determinant -1: the device's axes are left-handed",
        "change the sign of one of the three columns, or exchange two of them",
        lambda q: q,
        mirrored=True,
    )
