"""The devices of a rig as a session has them: drivers made of the rig file, connected, recorded, checked.

Open first `site.connected`: all devices of a session, each with its reader thread, and what stops the arm when one
fails. `recorder` keeps the recording whole, `check` is `calibeam check`, `encoder_log` is `calibeam log`. A new
instrument gets a function like `instruments.psd_driver` and a line in `site`.
"""
