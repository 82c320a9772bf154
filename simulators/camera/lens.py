"""Where each pixel of the emulated camera looks: the barrel of its lens by the division model.

    ideal = distorted / (1 + barrel r^2),  r the distorted radius in focal lengths

Source: A. Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001. Not
the polynomial that calibrations fit, so that these have something left to fit. Negative: a barrel, as of most lenses.
"""

import numpy as np
from numpy.typing import NDArray

from simulators.camera.true_camera import TrueCamera

Singles = NDArray[np.float32]


def slopes(camera: TrueCamera) -> tuple[Singles, Singles]:
    """Right and down (height, width) of the ray through each pixel's middle, per unit of depth."""
    across = (np.arange(camera.width_px) - camera.centre_px[0]) / camera.focal_px
    down = (np.arange(camera.height_px) - camera.centre_px[1]) / camera.focal_px
    x, y = np.meshgrid(across, down)
    widened = 1.0 / (1.0 + camera.barrel * (x * x + y * y))
    return (x * widened).astype(np.float32), (y * widened).astype(np.float32)
