"""What a run over a fleet is given: its workers, and the names of the files that it leaves."""

import os
from dataclasses import dataclass, field
from enum import Enum


class Engine(Enum):
    """Joblib's names for where the work is done."""

    LOKY = "loky"
    DASK = "dask"


@dataclass(frozen=True)
class Workers:
    """Which workers, how many of our own (one a core), and where a cluster's scheduler listens."""

    engine: Engine = Engine.LOKY
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    scheduler: str | None = None


TABLE, PAGE = "fleet.parquet", "fleet.html"
JOURNAL = "fleet.rows.jsonl"  # rows of a run that is not over, or was killed
