"""A network camera that sees the printed board of the fixture.

`emulator` serves pictures over HTTP, `picture` makes them, `true_camera` has where the camera truly stands.
"""
