"""Chapters of the report of a session, one file each."""
