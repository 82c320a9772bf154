"""Sessions of the concealed bench, read as a diagnosis reads them: the truth stays sealed."""

from acquisition.recording import read
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted


def recording_of(folder, **wanted):
    """A session written to `folder` and read back; fields of simulators.conceal.wanted.Wanted."""
    write_case(conceal(Wanted(**wanted)), folder)
    return read(folder / "recording")


def changed(samples, **columns):
    """A copy with other columns."""
    return type(samples)({**{k: v.copy() for k, v in samples.columns.items()}, **columns}, samples.n_joints)
