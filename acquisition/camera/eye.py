"""What coarse aim wants of a camera: a picture of now."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.uint8]


class Eye(Protocol):
    """A camera that looks; raises DeviceError, and every call ends."""

    def picture(self) -> Grey:
        """(height, width), taken after the call began: the arm stood when it was made."""
        ...
