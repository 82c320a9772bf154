"""What is worked out of a recording, whatever command asks for it.

`identification` makes a model, `diagnosis` a diagnosis, `comparison` compares with a simulation, and
`session_results.write_session_results` does all that follows a session.
"""
