"""Two sessions of one plan by the concealed bench: an arm that is off, with mechanisms, and a simulation of it."""

from pathlib import Path

from acquisition.recording import read
from simulators.conceal.case import conceal
from simulators.conceal.case_files import Made, made, write_case
from simulators.conceal.wanted import Wanted


def case_of(**wanted):
    """A session whose rig file is in a notation with rows; its mechanisms are there to be taken."""
    return conceal(Wanted(**wanted))


def pair_of(folder: Path, case, measured: Made, simulated: Made):
    """Both, read back."""
    for name, how, seed in (("m", measured, 100), ("s", simulated, 200)):
        write_case(made(case, how, seed), folder / name)
    return tuple(read(folder / name / "recording") for name in ("m", "s"))
