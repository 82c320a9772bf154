"""Words that are gone from everything that a person reads: help, messages, reports, live page, documentation."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.trees import tree_of

ROOT = Path(__file__).parents[2]
PRODUCT = ("acquisition", "calibeam", "calibrate", "drivers", "simulators")
GONE = re.compile(
    r"\b(say|says|said|saying|tell|tells|told|doubt\w*|as drawn|the drawing says|looks? (?:at|for|like)|in vain|"
    r"wild rows?|part ways|parts? from|parted|believe[ds]?|beliefs?|blunders?|rivals?|(?<!; )free[- ]space|"
    r"would have shown|arrived, or stopped|your word|nobody knows|anew|um|urad)\b",
    re.IGNORECASE,
)
CODE = re.compile(r"`[^`]*`|\]\([^)]*\)|https?://\S+|^    .*$|^```.*?^```$", re.MULTILINE | re.DOTALL)
# Public names stay: columns, options, values of formats. "; free space" is about a disk.
EXCEPTED = {
    "acquisition/recording/files/explain.py": {"says"},
    "calibeam/commands/centre.py": {"um"},
    "calibeam/commands/correct.py": {"says"},
    "calibeam/commands/design.py": {"free-space"},
}


DEFINITIONS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def literals(path: Path) -> Iterator[str]:
    """What a program prints or raises: strings of several words, without docstrings; of a command, its help too."""
    tree = tree_of(path)
    shown = path.parent.name == "commands"
    docs = {
        id(n.body[0].value) for n in ast.walk(tree) if isinstance(n, DEFINITIONS) and n.body and _is_text(n.body[0])
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str) or " " not in node.value:
            continue
        if id(node) not in docs or (shown and "Parameters\n" in node.value):
            yield re.sub(r"`[^`]*`|```.*?```", "", node.value, flags=re.DOTALL)


def _is_text(statement: object) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def pages() -> list[Path]:
    """Decision notes are dated records, and keep their words."""
    found = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    return [path for path in found if path.parent.name != "decisions" or path.name == "index.md"]


@pytest.mark.parametrize("package", PRODUCT)
def test_no_message_help_or_report_uses_a_word_that_is_gone(package: str) -> None:
    found = {
        (path.relative_to(ROOT).as_posix(), m[0])
        for path in (ROOT / package).rglob("*.py")
        for text in literals(path)
        for m in GONE.finditer(text)
    }
    assert sorted(one for one in found if one[1] not in EXCEPTED.get(one[0], ())) == []


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_no_page_uses_a_word_that_is_gone(page: Path) -> None:
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    assert [text[max(0, m.start() - 30) : m.end() + 30] for m in GONE.finditer(text)] == []


@pytest.mark.parametrize("package", PRODUCT)
def test_no_docstring_uses_a_word_that_is_gone(package: str) -> None:
    found = [
        f"{path.relative_to(ROOT).as_posix()}: {m[0]}"
        for path in (ROOT / package).rglob("*.py")
        for node in ast.walk(tree_of(path))
        if isinstance(node, DEFINITIONS)
        for m in GONE.finditer(re.sub(r"`[^`]*`|two rival models, Biometrika", "", ast.get_docstring(node) or ""))
        if m[0] not in EXCEPTED.get(path.relative_to(ROOT).as_posix(), ())
    ]
    assert found == []
