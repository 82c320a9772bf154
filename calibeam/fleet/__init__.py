"""Many recordings at once: `calibeam batch`.

Open first `run.run`. Recordings are found (`recordings`), those that changed are handed to workers (`engine`,
`supervised`, `worker`), one row each comes back (`row`, `table`), and what all rows show together is worked out
(`drift`, `summary`) and drawn (`fleet_page`). A new column is a field of `row.Row`.
"""
