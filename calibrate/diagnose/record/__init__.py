"""diagnosis.json: its schema, and how it is read and written."""
