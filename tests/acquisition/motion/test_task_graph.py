"""The transform graph: any one unknown follows, what is missing is named, and by how much a loop does not close."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acquisition.errors import TaskError
from acquisition.motion.kinematics import apart, inverse, transform
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.transforms import Belt, Constant, Unread, Untaught, parse_equation

vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
poses = st.builds(transform, vectors, vectors)


def known(**T: np.ndarray) -> dict[str, Constant]:
    return {name: Constant(value) for name, value in T.items()}


@settings(max_examples=30, deadline=None)
@given(st.lists(poses, min_size=4, max_size=4), st.sampled_from(["Z", "E", "P", "PG"]))
def test_any_one_transform_of_a_position_can_be_the_unknown(four: list[np.ndarray], unknown: str) -> None:
    Z, E, P, PG = four
    graph = TaskGraph(known(Z=Z, E=E, P=P, PG=PG), {"grasp": parse_equation("Z T6 E = P PG")})
    T6 = graph.solve("grasp", "T6")
    np.testing.assert_allclose(T6, inverse(Z) @ P @ PG @ inverse(E), atol=1e-12)
    np.testing.assert_allclose(graph.solve("grasp", unknown, T6), graph.value(unknown), atol=1e-12)


def test_inverses_on_either_side_are_read_as_written() -> None:
    A, B = transform((0.1, 0.2, 0.3), (0.1, 0.0, 0.4)), transform((0.0, 0.5, 0.0), (0.0, 0.3, 0.0))
    graph = TaskGraph(known(A=A, B=B), {"p": parse_equation("A^-1 T6 = B⁻¹ A")})
    np.testing.assert_allclose(graph.solve("p", "T6"), A @ inverse(B) @ A, atol=1e-12)


def test_the_tool_stands_before_an_arm_that_is_written_inverted() -> None:
    Z, E, P = (transform((0.1, 0.0, k), (0.1 * k, 0.2, 0.3)) for k in (1.0, 2.0, 3.0))
    plain, turned = (
        TaskGraph(known(Z=Z, E=E, P=P), {"p": parse_equation(text)}).place("p")
        for text in ("Z T6 E = P", "E^-1 T6^-1 Z^-1 = P^-1")
    )
    np.testing.assert_allclose(turned.flange_at(0.0), plain.flange_at(0.0), atol=1e-12)
    np.testing.assert_allclose(turned.tool, E, atol=1e-12)
    np.testing.assert_allclose(turned.pos, plain.pos, atol=1e-12)


def test_a_reading_of_the_camera_gives_the_pin_and_then_the_position() -> None:
    CAM, PC = transform((1.0, 0.0, 1.0), (np.pi, 0.0, 0.0)), transform((0.1, 0.0, 0.8))
    one = Constant(np.eye(4))
    graph = TaskGraph(
        {"Z": one, "E": one, "CAM": Constant(CAM), "PC": Unread(), "P": Untaught(), "PG": one},
        {"grasp": parse_equation("Z T6 E = P PG")},
        (parse_equation("P = CAM PC"),),
    )
    with pytest.raises(TaskError, match=r"T6 is not determined.*P is missing \(not taught yet\).*with PC"):
        graph.solve("grasp", "T6")
    np.testing.assert_allclose(graph.with_value("PC", PC).solve("grasp", "T6"), CAM @ PC, atol=1e-12)


def test_a_loop_that_does_not_close_is_named_with_its_gap() -> None:
    graph = TaskGraph(
        known(P=transform((0.003, 0.0, 0.0)), CAM=np.eye(4), PC=np.eye(4)), {}, (parse_equation("P = CAM PC"),)
    )
    with pytest.raises(TaskError, match=r"P = CAM PC: this loop does not close, by 3\.000 mm and 0\.000 mrad"):
        graph.check()


@pytest.mark.parametrize(
    ("text", "why"),
    [("Z T6 E", 'one "="'), ("Z T6 = P+G", "no transform"), ("Z T6 = Q", "Q is not among"), ("Z = P", "T6 stands")],
)
def test_what_is_no_position_is_refused(text: str, why: str) -> None:
    with pytest.raises(TaskError, match=why):
        TaskGraph(known(Z=np.eye(4), P=np.eye(4)), {"p": parse_equation(text)})


def test_a_transform_that_stands_twice_cannot_be_taught_from_it() -> None:
    graph = TaskGraph(known(Z=np.eye(4), P=np.eye(4)), {"p": parse_equation("Z T6 P = P")})
    with pytest.raises(TaskError, match="stands in it 2 times"):
        graph.solve("p", "P", np.eye(4))


def test_moving_coordinates_are_split_off_and_carry_the_place() -> None:
    Z, OBJ, E = transform((0.0, 0.0, 0.5)), transform((0.0, 0.1, 0.0), (0.0, 0.2, 0.0)), transform((0.0, 0.0, 0.1))
    belt = Belt(transform((0.5, 0.0, 0.0), (0.0, 0.0, 0.3)), np.array([1.0, 0.0, 0.0]))
    graph = TaskGraph({**known(Z=Z, OBJ=OBJ, E=E), "CONV": belt}, {"on belt": parse_equation("Z T6 E = CONV OBJ")})
    place = graph.place("on belt")
    for s_m in (0.0, 0.4):
        np.testing.assert_allclose(place.flange_at(s_m), graph.solve("on belt", "T6", s_m=s_m), atol=1e-12)
    assert apart(place.flange_at(0.0), place.flange_at(0.4))[0] == pytest.approx(0.4)
    np.testing.assert_allclose(place.pos, OBJ, atol=1e-12)
    with pytest.raises(TaskError, match="cannot be taught"):
        graph.taught("CONV", "on belt", np.eye(4))
