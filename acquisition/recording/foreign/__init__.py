"""Tables and logs of other programs: read as they stand, understood, brought to SI, and made a session or streams.

`read_sheet` reads xlsx, CSV and Parquet; `understand` finds what the columns mean for a rig; `questions` are the units
that nobody has stated; `samples_of` and `write_session` make a session folder; `read_seats` joins one table a seat.
`read_log`, `understand_logs` and `recording_of` do the same for logs and ROS 2 bags, which become streams. A new name
of a column is a word in `column_meanings`, a new way to write an orientation a function in `rotations`, a new unit a
line in `heading_units`.
"""

from acquisition.recording.foreign.columns_record import ColumnsFile, columns_file, write_columns, write_session
from acquisition.recording.foreign.conversion import Understanding, questions, samples_of, understand
from acquisition.recording.foreign.logs import KINDS, read_log, recording_of, understand_logs
from acquisition.recording.foreign.sheet import Sheet
from acquisition.recording.foreign.sheet_files import read_seats, read_sheet

__all__ = [
    "KINDS",
    "ColumnsFile",
    "Sheet",
    "Understanding",
    "columns_file",
    "questions",
    "read_log",
    "read_seats",
    "read_sheet",
    "recording_of",
    "samples_of",
    "understand",
    "understand_logs",
    "write_columns",
    "write_session",
]
