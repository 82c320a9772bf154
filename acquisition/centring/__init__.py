"""Centring the beam: where to stand for it, how to find it, and the servo loop that brings it to the wanted spots.

`navigator` is what a session uses; it aims (`aim`, `camera`), searches (`search`) and runs the loop (`loop`) with a
strategy: `registered` for sessions, `strategies` where nothing is known of the fixture. A new strategy is a class with
the methods of `loop.Strategy`. `aim` states what has to be known of arm and fixture.
"""
