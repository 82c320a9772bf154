"""Which effects the chain has: terms of the catalogue are added, exchanged and removed.

Each change is confirmed by a refit, and weighed against how often noise alone does as well.
"""

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.stated_sizes import sandwich, sizes_of

__all__ = ["Bench", "sandwich", "sizes_of"]
