"""Models for commands that take geometry and frames only: what they leave out is printed in one line."""

import sys
from pathlib import Path

from calibrate.model.model_file import ModelFile, read_model


def read_geometry(path: Path) -> ModelFile:
    """model.json; a line on stderr where it holds effects. DataError as of `read_model`."""
    model = read_model(path)
    if model.effects:
        names = ", ".join(effect.name for effect in model.effects)
        print(f"{path.name}: this command takes geometry only, its effects are left out: {names}", file=sys.stderr)
    return model
