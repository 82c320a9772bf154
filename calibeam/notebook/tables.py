"""Tables in a notebook: of pandas where it is installed, which we do not need."""

import importlib
from typing import Any

SCREEN = 30  # rows of a table that is shown by itself


def pandas_if_installed() -> Any:
    """The module where it is installed, else None."""
    try:
        return importlib.import_module("pandas")
    except ImportError:
        return None
