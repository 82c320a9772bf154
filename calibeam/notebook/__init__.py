"""For notebooks and scripts: a recording opened, identified, diagnosed, drawn and reported in a few lines.

    import calibeam

    session = calibeam.open("recording.mcap")            # or calibeam.session("rig.toml", q_rad, positions_m)
    model = session.identify()

The same functions stand behind the command line; docs/python.md has all of it as examples.
"""

from calibeam.notebook.model import Model, open_model
from calibeam.notebook.session import Session, open_recording, session_of_arrays

__all__ = ["Model", "Session", "open_model", "open_recording", "session_of_arrays"]
