"""Fit plans: the documented example is read, and every fault has its line, its key and a remedy."""

import re

import pytest

from acquisition.recording.rig_schema import ArmModel
from calibrate.errors import DataError
from calibrate.fit import Loss, Method
from calibrate.fit_plan import DEFAULT, InstrumentName, parse_plan, read_plan
from calibrate.redundant import Redundant
from calibrate.uncertainty.splits import SplitKind


def test_the_example_of_the_documentation_is_a_plan(request):
    text = (request.config.rootpath / "docs" / "formats.md").read_text()
    (example,) = re.findall(r"```toml\n(.*?)```", text[text.index("## The fit plan") :], re.DOTALL)
    plan = parse_plan(example, "fit.toml")
    assert plan.model is ArmModel.LOCAL_POE
    assert plan.instruments == (InstrumentName.POSITION, InstrumentName.WIRE)
    assert (plan.method, plan.robust_loss, plan.of_redundant) == (Method.DOGLEG, Loss.HUBER, Redundant.REMOVED)
    assert plan.splits == (SplitKind.RANDOM, SplitKind.LAST)
    assert plan.priors == {"link*.x": 5e-4, "link2.*": 1e-3}


def test_a_plan_that_says_nothing_is_the_default():
    assert parse_plan("schema = 1", "fit.toml") == DEFAULT


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("fre = []", "line 2: unknown key 'fre' in the file; did you mean 'free'?"),
        ('loss = "hubert"', "line 2: loss = 'hubert' in the file: .*did you mean 'huber'"),
        ('solver = "lm"', "line 2: .*known are levenberg-marquardt, dog-leg"),
        ('instruments = ["tracker"]', "line 2: instruments = 'tracker'.*known are dual-psd"),
        ("share = 0.7", "line 2: share = 0.7 in the file: expected float <= 0.5"),
        ('[priors]\n"link1.length" = -1.0', r"line 3: link1.length = -1.0 in \[priors\]: expected float >= 1e-20"),
        ('instruments = ["position", "distance"]', "line 2: 'position' and 'distance' are the same readings"),
        ('share = 0\nsplits = ["last"]', "line 2: share = 0 holds nothing out"),
        ("free = [", "not TOML"),
    ],
)
def test_a_fault_has_its_line_and_a_remedy(line, says):
    with pytest.raises(DataError, match=says) as caught:
        parse_plan(f"schema = 1\n{line}", "my/fit.toml")
    assert str(caught.value).startswith("my/fit.toml")


def test_another_version_and_a_missing_file_are_refused_by_name(tmp_path):
    with pytest.raises(DataError, match=r"line 1: schema = 2 in the file: .*reads schema 1"):
        parse_plan("schema = 2", "fit.toml")
    with pytest.raises(DataError, match="the file needs the key 'schema'"):
        parse_plan('loss = "huber"', "fit.toml")
    with pytest.raises(DataError, match="cannot read the fit plan"):
        read_plan(tmp_path / "none.toml")
