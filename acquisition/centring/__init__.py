"""Centring the beam: where to stand for it, how to find it, and the servo loop that brings it to the wanted spots.

`navigator` is what a session uses; it aims (`aim`, `by_camera`), searches (`search`) and runs the loop (`loop`) with
a strategy: `registered` for sessions, `measured` where nothing is known of the fixture. A new strategy is a class with
`propose` and `learn` (`loop.Strategy`). `believed` states what has to be known of arm and fixture.
"""
