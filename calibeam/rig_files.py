"""Where the shipped rig files are: `rigs/` of a checkout, or their copies in an installed package."""

from pathlib import Path

CHECKOUT = Path(__file__).parents[1] / "rigs"
INSTALLED = Path(__file__).parent / "rigs"  # made by the wheel: pyproject.toml, force-include
RIGS = INSTALLED if INSTALLED.is_dir() else CHECKOUT
