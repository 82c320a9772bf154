"""Loaded before any test: the same thread setting that the program has."""

import calibeam  # noqa: F401 - sets the thread count before numpy is loaded
