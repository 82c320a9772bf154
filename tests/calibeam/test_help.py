"""Help of every command: examples as code blocks, no machinery of the parser, several values as it shows them."""

import re
from pathlib import Path

import pytest

from calibeam.cli import app, run
from calibeam.command_list import COMMANDS


def commands() -> dict[str, object]:
    """Every command and subcommand, loaded."""
    found: dict[str, object] = {}
    for name in COMMANDS:
        one = app[name]
        inner = [sub for sub in one if not sub.startswith("-")]
        found |= {f"{name} {sub}": one[sub] for sub in inner} or {name: one}
    return found


LOADED = commands()


def printed(name: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert run([*name.split(), "--help"]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("name", LOADED)
def test_help_reads_as_it_was_written(name: str, capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    text, source = printed(name, capsys), LOADED[name].default_command.__doc__
    assert "--empty-" not in text
    assert str(Path(__file__).parents[2]) not in text
    assert "[default: ()]" not in text
    assert source.count("*") == text.count("*") - text.count("│ *  ")
    blocks = re.findall(r"```\n(.*?)```", source, flags=re.DOTALL)
    assert blocks, "an example in a code block is missing"
    for line in filter(None, map(str.strip, "".join(blocks).splitlines())):
        assert line.startswith(f"calibeam {name}")
        assert line in text


SEVERAL = {  # option: a command line with two of its values, the second of them
    "identify --export": ("identify REC --export urdf mjcf", "mjcf"),
    "move --joints-deg": ("move RIG --joints-deg 17 -80 92", 92.0),
    "correct --frame": ("correct M P --out O --frame 1 2 3 0 0 0.5", "0.5"),
    "correct --start": ("correct M P --out O --start 17 -80", -80.0),
    "correct --condition": ("correct M P --out O --condition payload_kg=2 qd1_rad_s=1", "qd1_rad_s=1"),
    "emulate --hide": ("emulate RIG --hide a b", "b"),
    "replay --without": ("replay REC --model M --out O --without a b", "b"),
    "motion --only": ("motion --only a b", "b"),
    "simulate-errors --only": ("simulate-errors RIG --only a b", "b"),
    "prove --family": ("prove --family cones wire", "wire"),
    "prove --kind": ("prove --kind one three", "three"),
    "prove --without": ("prove --without a b", "b"),
}


def test_every_option_of_several_values_is_listed_here(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    shown = {f"{n} {o}" for n in LOADED for o in re.findall(r"(--[\w-]+) [A-Z|]+\.\.\.", printed(n, capsys))}
    assert shown == SEVERAL.keys()


@pytest.mark.parametrize("option", SEVERAL)
def test_several_values_follow_one_name_as_the_help_shows(option: str) -> None:
    line, last = SEVERAL[option]
    _, bound, _ = app.parse_args(line)
    value = bound.arguments[option.partition(" --")[2].replace("-", "_")][-1]
    assert getattr(value, "value", value) == last
