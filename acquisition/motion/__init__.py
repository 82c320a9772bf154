"""Motion of the arm: tasks (`task`) become paths (`paths`), a dry run judges them (`plan`), and the one `gate` streams
them and brakes. `kinematics` states what has to be known of an arm, `inverse` solves it; `states` is the table of what
a motion can be doing. A new kind of transform is a class in `task.transforms`, a new kind of leg one in `paths.legs`.
"""
