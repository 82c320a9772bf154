"""Effects that an arm, its mounting or an instrument may have: one file an entry of the catalogue, with its source."""
