"""What can go wrong with a recording, a rig file or a table of samples, as one short tree.

RecordingError      file missing, damaged, of another kind, or the disk refuses
|-- RigFileError    the rig text: file, line, key, value, remedy
`-- SamplesError    the settled samples: file, row, column, value, remedy
"""


class RecordingError(Exception):
    """Base of all errors of the recording; the message names the thing, the place, the value and the remedy."""


class RigFileError(RecordingError):
    """A rig that cannot be taken as it is written; the message holds the file, the line and the key."""


class SamplesError(RecordingError):
    """A table of settled samples that cannot be taken as it is; the message holds the file, the row and the column."""
