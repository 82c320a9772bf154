"""A path as a function of time: segments as asked for and blends about the corners (`segments`), legs in their own
coordinates (`legs`), and all of it as one curve (`path`). Source: R. Paul, Robot Manipulators, 1981, ch. 5.
"""
