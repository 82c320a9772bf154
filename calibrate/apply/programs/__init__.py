"""Robot programs with their targets corrected: KRL, RAPID, URScript, FANUC LS. Nothing but the targets changes."""

from calibrate.apply.programs.rewriting import correct_program, dialect_of

__all__ = ["correct_program", "dialect_of"]
