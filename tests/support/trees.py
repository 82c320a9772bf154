"""Syntax trees of our own files: several tests of a process read them all, and parsing them takes seconds."""

import ast
from functools import cache
from pathlib import Path


@cache
def tree_of(path: Path) -> ast.Module:
    """Of a source file; not to be changed."""
    return ast.parse(path.read_text(encoding="utf-8"))
