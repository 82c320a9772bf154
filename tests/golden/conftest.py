"""What is frozen, by the name of the file in data/expected."""

import json
from collections.abc import Callable

import pytest

from .answers import DATA
from .program import Json


@pytest.fixture(scope="session")
def frozen() -> Callable[[str], Json]:
    def read(name: str) -> Json:
        return json.loads((DATA / "expected" / f"{name}.json").read_text(encoding="utf-8"))

    return read
