"""Programs of robot controllers whose targets are corrected: only literals change, everything else is kept.

A dialect is one file beside this one and one line in `DIALECTS` (rewriting.py): where a program's targets stand in its
text, in which units and rotations, and how a point-to-point move to joint angles is written.
"""

from calibrate.apply.programs.rewriting import correct_program, dialect_of

__all__ = ["correct_program", "dialect_of"]
