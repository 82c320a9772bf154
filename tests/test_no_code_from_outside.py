"""Nothing that came over a wire or from a file is run: no shell, no pickle, no eval, in any folder of the program.

`make lint` refuses most of it, too (ruff's rules S102, S3 and S6); a rule can be switched off in a line, this cannot.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.trees import tree_of

ROOT = Path(__file__).parents[1]
FOLDERS = ("drivers", "acquisition", "calibrate", "simulators", "calibeam")
MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve", "code", "codeop", "runpy"}
CALLS = {"eval", "exec", "compile", "__import__"}
METHODS = {
    ("os", "system"),
    ("os", "popen"),
    ("subprocess", "getoutput"),
    ("subprocess", "getstatusoutput"),
    ("yaml", "load"),
}
KEYWORDS = {"shell", "allow_pickle"}


def forbidden(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names if alias.name.split(".")[0] in MODULES)
            case ast.ImportFrom(module=str(module)) if module.split(".")[0] in MODULES:
                yield module
            case ast.Call(func=ast.Name(id=name)) if name in CALLS:
                yield name
            case ast.Call(func=ast.Attribute(value=ast.Name(id=module), attr=name)) if (module, name) in METHODS:
                yield f"{module}.{name}"
            case ast.Call(keywords=keywords):
                yield from (f"{k.arg}=" for k in keywords if k.arg in KEYWORDS and not _is_false(k.value))
            case _:
                pass


def _is_false(value: ast.expr) -> bool:
    return isinstance(value, ast.Constant) and value.value is False


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_runs_what_came_from_outside(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    found = {str(path.relative_to(ROOT)): list(forbidden(tree_of(path))) for path in files}
    assert {path: what for path, what in found.items() if what} == {}


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from shelve import open",
        "eval('1')",
        "os.system('ls')",
        "run('ls', shell=True)",
        "import dill",
    ],
)
def test_each_way_is_seen(text: str) -> None:
    assert list(forbidden(ast.parse(text)))
