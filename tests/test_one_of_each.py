"""What the design wants once stands once: a second one has to give its reason here. docs/decisions/0036."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("drivers", "acquisition", "calibrate", "calibeam")  # simulators have their own, so that no proof is circular
SOLVED = {"solve", "lstsq", "pinv", "inv"}
JOINT_STEPS = {
    "acquisition/motion/inverse/solve.py": "to flange poses, and to places of a point: the inverse kinematics",
    "calibrate/model/chain.py": "to readings of any instrument, which calibrate may not ask of acquisition",
    "acquisition/centring/search.py": "two linear steps of a beam, and moves of the arm between looks at its spots",
    "acquisition/centring/registered.py": "uphill in the grip of the servo, while the beam is held",
    "calibrate/compare/corrected.py": "one linear step for each pose of a pair",
}
TURNED_PARTS = {
    "calibrate/model/arms": "the arm models themselves",
    "calibrate/model/with_effects/ported_chain.py": "effects at every port of the chain",
    "calibrate/apply/predicting.py": "the same, for the derivative by values",
    "calibeam/simulation/rig_in_numbers.py": "no kinematics: zeros go over to the simulators, which have their own",
}


@cache
def texts() -> dict[str, str]:
    paths = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
    return {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in paths}


def sources(*words: str) -> Iterator[tuple[str, ast.Module]]:
    """Path and tree of the files that hold all these words; parsing every file takes seconds."""
    for path, text in texts().items():
        if all(word in text for word in words):
            yield path, ast.parse(text)


def solvers(tree: ast.Module) -> set[str]:
    """Functions of a file in which a linear system is solved, by themselves or by others of the file."""
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    found: set[str] = set()
    while more := {name for name, node in functions.items() if name not in found and solves(node, found)}:
        found |= more
    return found


def solves(node: ast.AST, solvers: set[str]) -> bool:
    calls = [one.func for one in ast.walk(node) if isinstance(one, ast.Call)]
    return any(
        (isinstance(f, ast.Attribute) and ast.unparse(f) in {f"np.linalg.{name}" for name in SOLVED})
        or (isinstance(f, ast.Name) and f.id in solvers)
        for f in calls
    )


def steps_joints(loop: ast.AST) -> bool:
    """Whether joint readings, or some of their rows, are bound anew below a node."""
    stored = [one for one in ast.walk(loop) if isinstance(one, ast.Name | ast.Subscript)]
    names = [one.value if isinstance(one, ast.Subscript) else one for one in stored if isinstance(one.ctx, ast.Store)]
    return any(isinstance(name, ast.Name) and name.id == "q_rad" for name in names)


def test_joint_readings_are_solved_for_step_by_step_in_one_place() -> None:
    found = {
        path
        for path, tree in sources("np.linalg.", "q_rad")
        for loop in ast.walk(tree)
        if isinstance(loop, ast.For | ast.While) and steps_joints(loop) and solves(loop, solvers(tree))
    }
    assert found == set(JOINT_STEPS)


def test_arms_are_turned_by_one_forward_kinematics() -> None:
    """Joint offsets are what every forward kinematics has to ask for."""
    users = {
        path
        for path, tree in sources("angle_offset_rad")
        for one in ast.walk(tree)
        if isinstance(one, ast.Attribute) and one.attr == "angle_offset_rad"
    }
    assert {path for path in users if not path.startswith(tuple(TURNED_PARTS))} == set()


def test_points_are_brought_onto_points_in_one_place() -> None:
    """Acquisition, which may not import calibrate, turns directions by itself."""
    found = {
        path
        for path, text in texts().items()
        if "align_vectors" in text or ("linalg.svd" in text and "linalg.det" in text)
    }
    assert {path for path in found if not path.startswith("acquisition")} == {"calibrate/model/alignment.py"}


def test_ways_to_leave_rows_out_and_chain_rules_are_stated_once() -> None:
    for name in ("Split", "by_place", "last_block", "chain_frames", "unfolded_faces", "by_beam", "Conditions"):
        defined = [
            node.name
            for _, tree in sources(f" {name}")
            for node in ast.walk(tree)
            if isinstance(node, ast.ClassDef | ast.FunctionDef)
        ]
        assert defined.count(name) == 1, name
