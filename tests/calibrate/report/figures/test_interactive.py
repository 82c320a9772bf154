"""Figures that can be turned: only where asked for, within the page, and no script but their own may run."""

import ast
import re
from pathlib import Path

import pytest

import calibrate.report
from calibrate.report.elements.html import Html
from calibrate.report.elements.html import page as shell
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.figures.plots import interactive_chapter
from calibrate.report.figures.session_figures import session_figures

REPORT = Path(calibrate.report.__file__).parent


@pytest.fixture(scope="module")
def known(arm_session):
    session = arm_session(40)
    recording = session.recording(session.positions(), "</script><script>alert(1)</script>")
    return session_evidence(recording, session.model(recording))


@pytest.fixture(scope="module")
def page(known):
    chapter = interactive_chapter(session_figures(known))
    return shell(known.recording.rig.name, Html(""), {}, (chapter,), "calibeam", kind="t", scripts=True)


def test_the_library_is_imported_by_the_function_that_needs_it_and_nowhere_else():
    named = [path for path in REPORT.rglob("*.py") if "plotly" in path.read_text(encoding="utf-8").lower()]
    importing = {path.name for path in named for node in ast.walk(parsed(path)) if imports_plotly(node)}
    assert importing == {"plots.py"}
    assert not any(imports_plotly(node) for path in named for node in parsed(path).body)


def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def imports_plotly(node):
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
    names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
    return any(name.partition(".")[0] == "plotly" for name in names)


def test_only_the_scripts_of_the_page_itself_may_run(page):
    scripts = re.findall(r"<script>", page)
    (policy,) = re.findall(r'content="(default-src[^"]*)"', page)
    assert len(scripts) == page.count("</script>") == 3
    assert policy.count("sha256-") == 3
    assert "unsafe-inline" not in policy.partition("script-src")[2]
    assert "<script>alert" not in page


def test_every_pose_can_be_asked_for_its_joints_and_errors(known, page):
    labels = re.findall(r"sample (\d+)<br>nominal [^\"]*calibrated [^\"]*<br>J1 [^\"]*J6 ", page)
    assert {int(n) for n in labels} == set(range(1, known.model.poses + 1))
