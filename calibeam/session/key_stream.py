"""What is typed, without what a terminal sends for arrows, function keys and the mouse: letters behind an ESC.

Taken letter by letter, an arrow up (ESC [ A) would abort, and F3 (ESC O R) would set a paused arm going.
Source of the forms: ECMA-48, 5.4 (control sequences); xterm, "Control Sequences" (ESC O, mouse of X10); Linux
console_codes(4) (F1 to F5 as ESC [ [ A and so on). A SPACE never belongs to one, so that it always pauses.
"""

import re

ESC = "\x1b"
WHOLE = re.compile(r"\x1b(?:\[M.{3}|\[\[?[0-?]*[@-Z\\^-~$]|O[0-9;]*[@-~])", re.DOTALL)
BEGUN = re.compile(r"\x1b(?:\[\[?[0-?]*|O[0-9;]*)?\Z")  # its end may come with the next read


class KeyStream:
    """Keeps the beginning of a sequence that was not read to its end."""

    def __init__(self) -> None:
        self._begun = ""

    def keys(self, typed: str) -> str:
        """The keys among what was read now. A lone ESC is none, and takes no key behind it along."""
        text = WHOLE.sub("", self._begun + typed)
        begun = BEGUN.search(text)
        self._begun = "" if begun is None else begun[0]
        return text.removesuffix(self._begun).replace(ESC, "")
