"""What `make test FAST=1` runs: tests near what was changed in the last hour, and the laws of the whole code base.

Near is counted along imports: a test that imports a changed module itself stands at 1, one whose module imports it at
2, and so on; a changed test, or one beside a changed conftest, at 0. Nearest first, until the time is full that the
last whole run took for them (out/tests/*.xml). What is left out is counted in a printed line.
"""

import ast
import subprocess
import xml.etree.ElementTree as ET
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from tests.conftest import on_wires
from tests.support.trees import tree_of

ROOT = Path(__file__).parents[1]
PACKAGES = ("drivers", "acquisition", "calibrate", "simulators", "calibeam")
LAWS = (
    "tests/test_architecture.py", "tests/test_file_records.py", "tests/test_imports.py",
    "tests/test_no_code_from_outside.py", "tests/test_one_of_each.py", "tests/test_phases.py",
)  # fmt: skip
FULL_S = 50.0  # of the calculation of all tests that are taken, on two workers; the laws and the start come on top
UNKNOWN_S = 5.0  # of a file that no run has timed


def fast_files(since: str = "1 hour ago") -> tuple[list[str], str]:
    """Files for pytest, and a sentence on what was left out."""
    near = distances(changed(since), imported_by(), tests())
    took = durations()
    taken: list[str] = [*LAWS]
    full_s, wired, far = 0.0, 0, 0
    for path in sorted(near, key=lambda path: (near[path], took.get(path, UNKNOWN_S), path)):
        if path in LAWS:
            continue
        if on_wires(ROOT / path):
            wired += 1
        elif full_s + took.get(path, UNKNOWN_S) > FULL_S:
            far += 1
        else:
            taken.append(path)
            full_s += took.get(path, UNKNOWN_S)
    return taken, (
        f"{len(near)} test files reach what was changed since {since}: {len(taken) - len(LAWS)} run, with {len(LAWS)} "
        f"of laws; left out: {far} farther off or longer, {wired} on wires (make test)"
    )


def changed(since: str) -> set[str]:
    """Paths that commits since then, the index and the work tree have touched."""
    commands = (
        ("git", "log", f"--since={since}", "--name-only", "--format="),
        ("git", "diff", "HEAD", "--name-only"),
        ("git", "ls-files", "--others", "--exclude-standard"),
    )
    run = (subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True) for words in commands)
    return {line for done in run for line in done.stdout.splitlines() if line}


def tests() -> dict[str, set[str]]:
    """Test file -> modules that it, and the helpers of tests that it imports, import."""
    own = {path.relative_to(ROOT).as_posix(): set(_imports(path)) for path in (ROOT / "tests").rglob("*.py")}
    return {
        path: modules | {m for helper in _helpers(path, modules) for m in own.get(helper, ())}
        for path, modules in own.items()
        if Path(path).name.startswith("test_")
    }


def imported_by() -> Mapping[str, set[str]]:
    """Module -> modules that import it, of our packages."""
    import grimp

    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    return {module: set(graph.find_modules_that_directly_import(module)) for module in graph.modules}


def distances(
    paths: Iterable[str], importers: Mapping[str, set[str]], of_tests: Mapping[str, set[str]]
) -> dict[str, int]:
    """Test file -> its distance from the nearest of the changed paths; those that do not reach any are not in it."""
    paths = set(paths)
    modules = {_module(path): 1 for path in paths if path.endswith(".py") and path.split("/")[0] in PACKAGES}
    queue = deque(modules)
    while queue:
        module = queue.popleft()
        for other in importers.get(module, set()) - modules.keys():
            modules[other] = modules[module] + 1
            queue.append(other)
    folders = {path.rpartition("/")[0] for path in paths if path.endswith("/conftest.py")}
    out: dict[str, int] = {}
    for test, imports in of_tests.items():
        if test in paths or any(test.startswith(f"{folder}/") for folder in folders):
            out[test] = 0
        elif reached := [modules[m] for m in imports if m in modules]:
            out[test] = min(reached)
        elif test.startswith("tests/docs/") and any(path.startswith(("docs/", "README")) for path in paths):
            out[test] = 1
    return out


def durations() -> dict[str, float]:
    """Test file -> seconds in the last whole run here; empty without one."""
    out: defaultdict[str, float] = defaultdict(float)
    for phase in ("calculating", "devices-on-wires", "sessions-on-wires"):
        results = ROOT / "out" / "tests" / f"{phase}.xml"
        for case in ET.parse(results).getroot().iter("testcase") if results.exists() else ():
            out[f"{case.get('classname', '').replace('.', '/')}.py"] += float(case.get("time", 0.0))
    return dict(out)


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _helpers(path: str, modules: set[str]) -> list[str]:
    """Files of the tests' own helpers: imported ones, and the conftests above."""
    named = [f"{m.replace('.', '/')}.py" for m in modules if m.startswith("tests.")]
    return [*named, *(f"{folder.as_posix()}/conftest.py" for folder in Path(path).parents if folder.name)]


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
