"""Small files that hold much, or that a careless reader reads again and again: 60 s and 1 GB for each (bombs.py)."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.calibeam.mutations.bombs import BOMBS, OPEN, Bomb, run_bomb
from tests.calibeam.mutations.server import Server


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bombs") / "good"


@pytest.fixture(scope="module")
def server(good: Path) -> Iterator[Server]:
    with Server(good) as started:
        yield started


@pytest.mark.endure
@pytest.mark.parametrize("bomb", BOMBS, ids=lambda bomb: bomb.name)
def test_a_file_of_32_mb_takes_no_more_than_a_gigabyte_and_a_minute(
    bomb: Bomb, server: Server, good: Path, tmp_path: Path
) -> None:
    if bomb.name in OPEN:
        pytest.xfail(OPEN[bomb.name])
    _, found = run_bomb(server, good, bomb, tmp_path / "case")
    assert not found, "\n".join(map(str, found))


def test_what_is_still_open_is_in_the_table() -> None:
    assert OPEN.keys() <= {bomb.name for bomb in BOMBS}
