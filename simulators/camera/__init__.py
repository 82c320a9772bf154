"""A network camera that sees the printed board of the fixture.

`emulator` serves pictures over HTTP, `picture` makes them and has where the camera truly stands.
"""
