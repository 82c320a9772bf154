"""The small proof of every change: conceal, diagnose in another process, reveal, score; and what is refused."""

import json
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.stream_reader import StreamReader

from calibeam import cli
from calibeam.commands import prove as command
from calibeam.prove.diagnosing import Answered
from calibeam.prove.prove import Plan
from calibeam.prove.record import ProofFile
from calibeam.prove.scenario import DEVELOPMENT
from calibeam.prove.seal import Layout, fingerprint
from calibrate.errors import DataError

PLAIN = ("--family", "tracker", "--enr", "3", "4", "--jobs", "1", "--seed", "21")


def _proved(out: Path, *options: str) -> ProofFile:
    assert cli.run(["prove", "--out", str(out), *PLAIN, *options, "--json"]) == 0
    return msgspec.json.decode((out / "proof.json").read_bytes(), type=ProofFile)


def _recorded_bytes(recorded: Path) -> Iterator[bytes]:
    """All that a recording holds, unpacked: a truth in a compressed batch would be seen by nobody, and be read."""
    with recorded.open("rb") as file:
        for record in StreamReader(file, emit_chunks=False).records:
            yield repr(record).encode()


@pytest.mark.usefixtures("bare_figures")
@pytest.mark.timeout(300)
def test_a_plain_effect_is_found_named_and_better_where_nobody_measured(tmp_path: Path) -> None:
    proof = _proved(tmp_path / "p", "--kind", "one", "--mechanism", "encoder-eccentricity", "--cases", "1")
    [case] = proof.cases
    assert case.error == ""
    assert case.defects[0].named
    assert case.held_out_after_m is not None
    assert case.floor_m is not None
    assert case.held_out_after_m < 1.2 * case.floor_m
    assert case.free_space_after_m is not None
    assert case.free_space_before_m is not None
    assert case.free_space_after_m < 0.5 * case.free_space_before_m
    truth = json.loads((tmp_path / "p" / "revealed" / f"{case.name}.json").read_bytes())
    assert truth["defects"][0]["mechanism"] == "encoder-eccentricity"
    assert "as expected" in (tmp_path / "p" / "proof.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("bare_figures")
@pytest.mark.timeout(300)
def test_an_interrupted_proof_goes_on_after_its_last_whole_slice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--kind", "one", "--mechanism", "encoder-eccentricity", "--cases", "2", "--out", str(tmp_path / "p"))
    proving = import_module("calibeam.prove.prove")
    diagnose, asked = proving.diagnose_cases, list[str]()

    def interrupted(layout: Layout, names: Sequence[str], *rest: Any) -> Iterator[Answered]:
        asked.extend(names)
        if asked == ["case-0000", "case-0001"]:
            raise KeyboardInterrupt
        yield from diagnose(layout, names, *rest)

    monkeypatch.setattr(proving, "SLICE", 1)
    monkeypatch.setattr(proving, "diagnose_cases", interrupted)
    assert cli.run(["prove", *PLAIN, *options]) == 3
    assert not (tmp_path / "p" / "proof.json").exists()
    assert (
        cli.run(["prove", *PLAIN, *options, "--without", "backlash", "--resume"]) == 1
    )  # not the proof that was begun
    assert cli.run(["prove", *PLAIN, *options, "--resume"]) == 0
    assert asked == ["case-0000", "case-0001", "case-0001"]
    proof = msgspec.json.decode((tmp_path / "p" / "proof.json").read_bytes(), type=ProofFile)
    hashes = (tmp_path / "p" / "hashes.txt").read_bytes()
    assert [f"{c.sha256}  {c.name}" for c in proof.cases] == hashes.decode().splitlines()
    assert proof.published == fingerprint(hashes)
    assert all(case.defects[0].named for case in proof.cases)


def test_nothing_is_resumed_where_nothing_was_begun(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["prove", "--out", str(tmp_path), "--cases", "1", "--resume"]) == 1
    assert "slices.json" in "".join(capsys.readouterr().err.split())


@pytest.mark.endure  # as `make mutate` does with ten effects
@pytest.mark.timeout(300)
def test_an_effect_taken_out_of_the_catalogue_turns_unknown_at_its_place(tmp_path: Path) -> None:
    """Reading lag: nothing else of the catalogue depends on the last move of a joint alone."""
    options = ("--kind", "one", "--mechanism", "slow-filter", "--cases", "1", "--without", "reading-lag")
    [case] = _proved(tmp_path / "p", *options).cases
    assert case.defects[0].physics == "unknown"
    assert case.defects[0].located
    assert case.defects[0].unknown_there
    assert not case.misnamed


@pytest.mark.endure  # as `make prove` does with every kind; tests/calibeam/test_recorded_streams.py is for every day
@pytest.mark.timeout(300)
def test_a_fault_that_only_streams_tell_is_found_and_named(tmp_path: Path) -> None:
    options = ("--kind", "streams", "--mechanism", "stream-slipping-encoder", "--cases", "1")
    [case] = _proved(tmp_path / "p", *options).cases
    assert case.error == ""
    assert case.defects[0].physics == "encoder-slip"
    assert case.defects[0].named
    [slip] = case.defects[0].sizes
    assert abs(slip.said - slip.true) < 4.0 * slip.sigma
    recorded = tmp_path / "p" / "recordings" / case.name / "recording.mcap"
    texts = list(_recorded_bytes(recorded))
    assert any(b"q1_rad" in text for text in texts)
    assert not any(word in text for text in texts for word in (b"slip", str(case.seed).encode()))


def test_a_seed_of_development_is_not_published(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["prove", "--out", str(tmp_path / "p"), "--seed", "21", "--publish"]) == 1
    assert "seed 21 is reserved for development" in " ".join(capsys.readouterr().err.split())


def test_a_catalogue_with_effects_taken_out_is_not_published(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--seed", "5000", "--publish", "--without", "backlash")
    assert cli.run(["prove", "--out", str(tmp_path / "p"), *options]) == 1
    assert "needs the whole catalogue" in " ".join(capsys.readouterr().err.split())


def test_a_choice_of_cases_is_not_published(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for choice in (("--kind", "one"), ("--family", "tracker"), ("--enr", "3", "8"), ("--mechanism", "slack-drive")):
        assert cli.run(["prove", "--out", str(tmp_path / "p"), "--publish", *choice]) == 1
        assert "all kinds of cases" in " ".join(capsys.readouterr().err.split())


def test_nobody_looks_at_the_published_cases_by_chance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[Plan] = []

    def stop(out: Path, plan: Plan, *_: object, **__: object) -> ProofFile:
        planned.append(plan)
        raise DataError("enough seen")

    monkeypatch.setattr(command, "prove", stop)
    for options in ((), ("--publish",)):
        assert cli.run(["prove", "--out", str(tmp_path / "p"), *options]) == 1
    assert [plan.seed < DEVELOPMENT for plan in planned] == [True, False]
    assert planned[1].seed == command.PUBLISHED_SEED


def test_a_folder_with_something_in_it_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "old.txt").write_text("of another proof")
    assert cli.run(["prove", "--out", str(tmp_path), "--cases", "1"]) == 1
    assert "not empty" in capsys.readouterr().err


def test_physics_that_no_catalogue_has_cannot_be_taken_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["prove", "--out", str(tmp_path / "p"), "--without", "magic"]) == 1
    assert "no physics of the catalogue" in " ".join(capsys.readouterr().err.split())


def test_a_trouble_that_is_not_known_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["prove", "--out", str(tmp_path / "p"), "--kind", "raised", "--mechanism", "soft-joint"]) == 1
    assert "detector-local-defect" in capsys.readouterr().err
