"""Pages for a person: chapters that a session has or has not, one verdict, every quantity with one definition."""
