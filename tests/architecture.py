"""The house in figures, from its own source: how large its rooms are, which import which, which names occur twice.

python -m tests.architecture     each figure, what it may be today, and the target it is on its way to

The limits of today only ever fall: who adds a small module, a second name or a longer chain puts something else right.
"""

import ast
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.support.trees import tree_of

ROOT = Path(__file__).parents[1]
TOPS = ("drivers", "acquisition", "calibrate", "simulators", "calibeam")
CATALOGUES = ("effects", "sensors", "defects", "commands", "arms")  # one file an entry is their purpose
SMALL = 80  # lines: a module with one importer and fewer lives in its importer


@dataclass(frozen=True)
class Module:
    """One file: its dotted name, its lines, its tree, and which modules of ours it imports when it is loaded."""

    name: str
    text: str
    tree: ast.Module
    imports: frozenset[str]

    @property
    def lines(self) -> int:
        return len(self.text.splitlines())

    @property
    def is_face(self) -> bool:
        return (ROOT / Path(*self.name.split("."))).is_dir()


@cache
def modules() -> dict[str, Module]:
    """All product files by dotted name, __init__ by the name of its package."""
    paths = [p for top in TOPS for p in sorted((ROOT / top).rglob("*.py"))]
    named = {".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): p for p in paths}
    found: dict[str, Module] = {}
    for name, path in named.items():
        text = path.read_text(encoding="utf-8")
        tree = tree_of(path)
        imports = frozenset(m for m in _imported(tree.body, named.keys()) if m != name)
        found[name] = Module(name, text, tree, imports)
    return found


def _imported(body: list[ast.stmt], known: Collection[str]) -> Iterator[str]:
    """Names that are imported when the module is loaded: not inside functions, not for the type checker only."""
    for node in body:
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield from (m for m in (inner if inner in known else node.module,) if m in known)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" not in ast.dump(node.test):
            yield from _imported(node.body, known)


def lengths() -> list[int]:
    """Lines of every file that is not a bare face, ascending."""
    return sorted(m.lines for m in modules().values() if not (m.is_face and m.lines < 20))


@cache
def function_lengths() -> list[int]:
    """Lines of every function, ascending; its docstring is not counted, since a command's is its help."""
    return sorted(
        (f.end_lineno or 0) - f.lineno + 1 - (_lines_of(f.body[0]) if ast.get_docstring(f) else 0)
        for m in modules().values()
        for f in ast.walk(m.tree)
        if isinstance(f, ast.FunctionDef | ast.AsyncFunctionDef)
    )


def code_lines(module: Module) -> int:
    """Without blank lines, comments and docstrings: an explanation costs nothing."""
    holders = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    explained = {
        line
        for node in ast.walk(module.tree)
        if isinstance(node, holders) and ast.get_docstring(node, clean=False) is not None
        for line in range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1)
    }
    numbered = enumerate(module.text.splitlines(), start=1)
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") and n not in explained for n, line in numbered)


def _lines_of(node: ast.stmt) -> int:
    return (node.end_lineno or 0) - node.lineno + 1


def with_one_importer() -> list[str]:
    """Small modules that one other module imports, entries of catalogues apart."""
    importers = Counter(target for m in modules().values() for target in m.imports)
    return [
        m.name
        for m in modules().values()
        if importers[m.name] == 1 and m.lines < SMALL and not m.is_face and m.name.split(".")[-2] not in CATALOGUES
    ]


def repeated_classes() -> list[str]:
    """Class names that stand more than once in one top-level package."""
    names = Counter(
        (m.name.split(".")[0], node.name)
        for m in modules().values()
        for node in ast.walk(m.tree)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    return [f"{top}: {name}" for (top, name), times in names.items() if times > 1]


def repeated_files() -> list[str]:
    names = Counter(name.split(".")[-1] for name, m in modules().items() if not m.is_face)
    return [name for name, times in names.items() if times > 1 and name != "__main__"]


def chain() -> list[str]:
    """The longest way from module to imported module; ValueError names a circle."""
    longest: dict[str, list[str]] = {}
    under_way: list[str] = []

    def below(name: str) -> list[str]:
        if name in under_way:
            raise ValueError("circle of imports: " + " -> ".join([*under_way[under_way.index(name) :], name]))
        if name not in longest:
            under_way.append(name)
            longest[name] = [name, *max((below(m) for m in sorted(modules()[name].imports)), key=len, default=[])]
            under_way.pop()
        return longest[name]

    return max((below(name) for name in sorted(modules())), key=len)


def faces() -> dict[str, int]:
    """Packages of calibrate that export names, with how many."""
    found: dict[str, int] = {}
    for m in modules().values():
        if m.is_face and m.name.startswith("calibrate."):
            for node in m.tree.body:
                if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                    found[m.name] = len(ast.literal_eval(node.value))
    return found


def past_a_face() -> list[str]:
    """Imports, of another floor of calibrate or of the program, from a module inside a package that has a face."""
    doors = faces()

    def floor(name: str) -> list[str]:
        return name.split(".")[:2]

    return [
        f"{m.name} -> {node.module}"
        for m in modules().values()
        for node in ast.walk(m.tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.rpartition(".")[0] in doors
        if floor(m.name) != floor(node.module)
    ]


@dataclass(frozen=True)
class Figure:
    """What is counted, how, the most it may be today (it only ever falls), and the target of the design."""

    what: str
    count: Callable[[], int]
    today: int
    target: int


def _nine_of_ten(ascending: list[int]) -> int:
    return ascending[int(0.9 * len(ascending))]


def figures() -> tuple[Figure, ...]:
    """Nothing is counted yet: who collects the tests does not read the whole source."""
    return (
        Figure("product files", lambda: len(modules()), TODAY["files"], 550),
        Figure(
            "code lines of the product", lambda: sum(code_lines(m) for m in modules().values()), TODAY["code"], 72_500
        ),
        Figure("lines of the file in nine of ten files, at most", lambda: _nine_of_ten(lengths()), 400, 400),
        Figure("lines of nine of ten functions, at most", lambda: _nine_of_ten(function_lengths()), 40, 40),
        Figure("lines of the longest function", lambda: function_lengths()[-1], TODAY["longest_function"], 80),
        Figure("small modules with one importer", lambda: len(with_one_importer()), TODAY["one_importer"], 0),
        Figure("class names used twice in a top-level package", lambda: len(repeated_classes()), TODAY["classes"], 0),
        Figure("file names used twice", lambda: len(repeated_files()), TODAY["file_names"], 0),
        Figure("imports past the face of a package", lambda: len(past_a_face()), 0, 0),
        Figure("most names of a face", lambda: max(faces().values()), 15, 15),
        Figure("longest chain of imports", lambda: len(chain()), TODAY["chain"], 15),
    )


TODAY = {
    "files": 841,
    "code": 91_000,
    "longest_function": 53,
    "one_importer": 2,
    "classes": 0,
    "file_names": 59,
    "chain": 33,
}

if __name__ == "__main__":
    for figure in figures():
        print(f"{figure.count():7} {figure.what} (today <= {figure.today}, target {figure.target})")
    print(f"{lengths()[len(lengths()) // 2]:7} lines of the median file (target 120 to 220)")
    print("\n".join(chain()))
