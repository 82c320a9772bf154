"""A made-up truth and a made-up answer, for what a score makes of them."""

from collections.abc import Callable

import pytest

from calibeam.prove.record import CaseScore, DefectScore, NamedCause, TrueDefect


@pytest.fixture
def defect() -> Callable[..., TrueDefect]:
    def make(physics: str = "encoder-eccentricity", port: str = "joint2.angle", **more: object) -> TrueDefect:
        fields = {"mechanism": physics, "drivers": ("q2",), "figures": {"amplitude_rad": 1e-4}, "enr": 1.0} | more
        return TrueDefect(physics=physics, port=port, **fields)  # type: ignore[arg-type]

    return make


@pytest.fixture
def case() -> Callable[..., CaseScore]:
    def make(defects: tuple[DefectScore, ...] = (), said: tuple[NamedCause, ...] = (), **more: object) -> CaseScore:
        fields: dict[str, object] = {
            "name": "case-0000",
            "sha256": "",
            "kind": "one" if defects else "none",
            "family": "tracker",
            "places": 3,
            "samples": 200,
            "noise": "white",
            "seed": 5000,
            "enr_wanted": 1.0,
            "attempts": 0,
            "withheld": (),
            "verdict": "mismatch" if said else "consistent",
            "defects": defects,
            "said": said,
            "unexplained": False,
            "asks_for": False,
            "held_out_before_m": 2e-5,
            "held_out_after_m": 1e-5,
            "floor_m": 1e-5,
            "free_space_before_m": 3e-5,
            "free_space_after_m": 1e-5,
            "cpu_s": 3.0,
        }
        return CaseScore(**(fields | more))  # type: ignore[arg-type]

    return make


@pytest.fixture
def found() -> Callable[..., DefectScore]:
    def make(*, located: bool = True, named: bool = True, physics: str = "backlash", enr: float = 1.0) -> DefectScore:
        return DefectScore(
            mechanism=physics,
            physics=physics,
            port="joint2.angle",
            depends_on=("approach2",),
            enr=enr,
            located=located,
            equivalent="",
            named=named,
            driver=named,
            among_rivals=named,
            unknown_there=False,
        )

    return make
