"""A UR5e controller, PolyScope 5.12: RTDE, script ports and dashboard over one arm of an emulated world.

Open `emulator` first. A URScript command is an entry in `commands`, an RTDE variable one in `fields`.
"""
