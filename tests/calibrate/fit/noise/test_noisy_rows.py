"""Rows whose noise cannot be weighed are named, in place of an error of linear algebra."""

import numpy as np
import pytest

from calibrate.errors import DataError
from calibrate.fit.noise.restricted_likelihood import common_axes


@pytest.mark.parametrize("singular", [np.zeros((2, 2)), np.ones((2, 2))])
def test_a_row_whose_noise_leaves_a_coordinate_exact_is_named(singular):
    parts = np.tile(np.eye(2), (1, 4, 1, 1))
    parts[0, 2] = singular
    with pytest.raises(DataError, match="reading 3 of those fitted cannot be weighed"):
        common_axes(parts)
