"""What can go wrong with a recording, a rig file or a table of samples, as one short tree; and how errors show values.

RecordingError      file missing, damaged, of another kind, or the disk refuses
|-- RigFileError    the rig text: file, line, key, value, remedy
`-- SamplesError    the settled samples: file, row, column, value, remedy
"""

KEPT = "\n\t"
# Control characters of ASCII and Latin-1, and those of Unicode that turn the direction of what follows
CONTROLS = [*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
REPLACED = {code: "\ufffd" for code in CONTROLS if chr(code) not in KEPT}
VALUE_LENGTH, MESSAGE_LENGTH = 120, 300  # characters: a line of a terminal; what a person reads of an error


class RecordingError(Exception):
    """Base of all errors of the recording; the message names the thing, the place, the value and the remedy."""


class RigFileError(RecordingError):
    """A rig that cannot be taken as it is written; the message holds the file, the line and the key."""


class SamplesError(RecordingError):
    """A table of settled samples that cannot be taken as it is; the message holds the file, the row and the column."""


def cleaned(text: str) -> str:
    """Without control characters, each replaced by U+FFFD; line ends and tabs stay."""
    return text if text.isprintable() else text.translate(REPLACED)


def shown(value: object, most: int = VALUE_LENGTH) -> str:
    """A value or name as an error shows it: on one line, of at most `most` characters; text without quotes."""
    if isinstance(value, str):
        start = value[: most + 1]
        text = start if start.isprintable() else "".join(c if c.isprintable() else " " for c in start)
    else:
        try:
            text = repr(value)
        except (ValueError, RecursionError):  # integers of more than 4,300 digits; lists within lists without end
            text = f"a {type(value).__name__} that is too large to show"
    return text if len(text) <= most else text[: most - 1] + "…"


def brief(message: str, most: int = MESSAGE_LENGTH) -> str:
    """A message of at most `most` characters: beginning and end stay, since they name the place and the remedy."""
    if len(message) <= most:
        return message
    end = most // 3
    return f"{message[: most - end - 3]} … {message[-end:]}"
