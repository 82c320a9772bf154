"""Recordings with streams of a concealed session, and faults that show only in them.

`stream_session.streamed` makes them; a new fault is a class in `faults` and a name in `faults.FAULTS`.
"""
