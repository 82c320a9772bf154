"""Name and version of this program, as recordings carry it."""

from importlib.metadata import version

SOFTWARE = f"calibeam {version('calibeam')}"
