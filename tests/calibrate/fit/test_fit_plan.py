"""Fit plans: the documented example is read, and every fault has its line, its key and a remedy."""

import re

import pytest

from acquisition.recording.rig import ArmModel
from calibrate.errors import DataError
from calibrate.fit.fit_plan import (
    DEFAULT,
    MethodName,
    parse_plan,
    read_plan,
)
from calibrate.fit.held_out.splits import SplitKind
from calibrate.fit.rank.observability import Redundant
from calibrate.fit.solvers import DogLegRules, Loss, Method


def test_the_example_of_the_documentation_is_a_plan(request):
    text = (request.config.rootpath / "docs" / "formats.md").read_text()
    (example,) = re.findall(r"```toml\n(.*?)```", text[text.index("## The fit plan") :], re.DOTALL)
    plan = parse_plan(example, "fit.toml")
    assert plan.model is ArmModel.LOCAL_POE
    assert plan.instruments == ("position", "wire")
    assert (plan.algorithm, plan.robust_loss, plan.of_redundant) == (Method.DOGLEG, Loss.HUBER, Redundant.REMOVED)
    assert plan.method is MethodName.POINT_CONSTRAINT
    assert plan.splits == (SplitKind.RANDOM, SplitKind.LAST)
    assert plan.priors == {"link*.x": 5e-4, "link2.*": 1e-3}


def test_the_documented_numbers_of_dog_leg_are_the_usual_ones(request):
    text = (request.config.rootpath / "docs" / "formats.md").read_text()
    (example,) = re.findall(r"```toml\n(.*?)```", text[text.index("## The fit plan") :], re.DOTALL)
    assert parse_plan(example, "fit.toml").rules == DogLegRules()


def test_every_number_of_dog_leg_reaches_the_solver():
    text = 'schema = 1\nsolver = "dog-leg"\n[dog-leg]\n'
    numbers = "e1 = 1e-3\ne2 = 2e-3\ne3 = 3e-3\nkmax = 7\ndelta0 = 0.5\nsigma = 0.1\n"
    assert parse_plan(text + numbers, "fit.toml").rules == DogLegRules(1e-3, 2e-3, 3e-3, 7, 0.5, 0.1)
    assert parse_plan(text, "fit.toml").rules == DogLegRules()
    assert DEFAULT.rules is None


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
        ('solver = "dog-leg"\n[dog-leg]\ne3 = -1.0', r"line 4: e3 = -1.0 in \[dog-leg\]: expected float >= 0.0"),
        ('solver = "dog-leg"\n[dog-leg]\nkmax = 0', r"line 4: kmax = 0 in \[dog-leg\]: expected int >= 1"),
        ('solver = "dog-leg"\n[dog-leg]\ndelta0 = 0', r"line 4: delta0 = 0 in \[dog-leg\]: expected float >= 1e-12"),
        ('solver = "dog-leg"\n[dog-leg]\nsigma = 0.8', r"line 4: sigma = 0.8 in \[dog-leg\]: expected float <= 0.75"),
        (
            'solver = "dog-leg"\n[dog-leg]\ne2 = "small"',
            r"line 4: e2 = 'small' in \[dog-leg\]: expected float, got str",
        ),
        ('solver = "dog-leg"\n[dog-leg]\nradius = 1', r"line 4: unknown key 'radius' in \[dog-leg\]"),
        ("[dog-leg]\nkmax = 5", r"line 2: \[dog-leg\] has no meaning for solver = 'levenberg-marquardt'"),
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
