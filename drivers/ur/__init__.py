"""Universal Robots controllers: a lossless RTDE reader (`rtde_codec`, `reader`), motion by the ur-rtde library in a
supervised child process (`control`, `control_child`, `control_link`, `supervised`, `pulse`), and the dashboard
(`dashboard`).
"""
