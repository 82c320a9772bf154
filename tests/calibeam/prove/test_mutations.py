"""Every effect that is taken out is one of the catalogue, with a mechanism behind it; and what counts as caught."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from benchmarks.forgotten_effects import MUTATIONS, caught, main
from calibeam.prove.record import CaseScore, DefectScore, NamedCause
from calibrate.errors import DataError
from calibrate.model.effects.catalogue import EFFECTS
from simulators.conceal.wanted import INSTRUMENT
from simulators.defects import MECHANISMS

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]


def test_each_takes_out_what_its_mechanism_does() -> None:
    listed = {effect.physics for effect in EFFECTS}
    kinds = {kind.KIND: kind for kind in MECHANISMS}
    assert len({m.physics for m in MUTATIONS}) == len(MUTATIONS) >= 8
    for mutation in MUTATIONS:
        assert set(mutation.without) <= listed
        assert mutation.physics == kinds[mutation.mechanism].PHYSICS
        assert INSTRUMENT[mutation.family] in kinds[mutation.mechanism].INSTRUMENTS


def test_only_unknown_at_the_right_place_is_caught(case: Case, found: Found) -> None:
    there = msgspec.structs.replace(found(physics="unknown", named=False), unknown_there=True)
    not_located = msgspec.structs.replace(there, located=False)
    named = NamedCause("joint2.angle", "q2", "backlash", 0.99, "", placed=True, right=False)
    assert caught(case((there,), kind="outside"))
    assert not caught(case((not_located,), kind="outside"))
    assert not caught(case((there,), (named,), kind="outside"))
    assert caught(case((msgspec.structs.replace(there, unknown_there=False),), kind="outside", unexplained=True))


def test_an_effect_that_is_not_tried_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="not among those that are taken out; there are reading-lag"):
        main(tmp_path, ["magic"])
