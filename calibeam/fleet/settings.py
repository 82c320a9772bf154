"""Names in a folder of results."""

TABLE, PAGE = "fleet.parquet", "fleet.html"
JOURNAL = "fleet.rows.jsonl"  # rows of a run that is not over, or was killed
