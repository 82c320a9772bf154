"""Two recordings, or a recording and a simulation: matching of poses, what differs between them, and streams."""
