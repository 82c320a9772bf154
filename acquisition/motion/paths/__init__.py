"""A path as a function of time: segments as asked for (`segments`), legs in their own coordinates (`legs`), blends
about the corners (`blend`), and all of it as one curve (`path`). Source: R. Paul, Robot Manipulators, 1981, ch. 5.
"""
