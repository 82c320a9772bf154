"""A dozen rows, of which the fit can meet most exactly: none is odd for that, and one that is odd is still found."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import read
from calibrate.fit.identify.identify import identify
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

OFF_M = 0.02


def recorded(folder, seed, rows):
    write_case(conceal(Wanted("tracker", seed, samples=60)), folder)
    recording = read(folder / "recording")
    return recording.rig, recording.samples.take(np.arange(rows))


def left_out(rig, samples):
    found = identify(rig, samples, held_out_share=0.0, rng=np.random.default_rng(1))
    return [gross_error.rows for gross_error in found.blunders]


@pytest.mark.parametrize("seed", [1, 2, pytest.param(3, marks=pytest.mark.endure)])
def test_no_row_of_a_dozen_good_ones_is_left_out(tmp_path, seed):
    assert left_out(*recorded(tmp_path, seed, 12)) == []


@pytest.mark.parametrize("rows", [12, 16, 20])
def test_a_row_that_is_off_is_left_out_alone(tmp_path, rows):
    rig, samples = recorded(tmp_path, 1, rows)
    x_m = samples.column("x_m").copy()
    x_m[5] += OFF_M
    assert left_out(rig, replace(samples, columns={**samples.columns, "x_m": x_m})) == [(5,)]
