"""The live page: what happens in a session, for browsers, and a STOP.

Open first `page.live_page`. Readers and the session leave their newest in `feed` (kept in `health`), `composer` makes
the `messages` of it once for all viewers, `app` is the web application with its rules of access, `limits` its bounds.
Something new on the page is a field of a message, a line in `composer`, and its drawing in static/.
"""
