"""`calibeam centre` on emulated devices: one centring by each strategy, kept in a recording."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.cli import run
from calibeam.commands import centre
from calibeam.emulation import Emulation

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
PACE = 6.0  # emulated seconds in one


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A rig file whose devices are emulated ones that run."""
    with Emulation(RIG, seed=2, time_scale=PACE) as emulation:
        text = RIG.read_text().replace('host = "127.0.0.2"', f'host = "{emulation.address["robot"]["host"]}"')
        text = text.replace("out/emulated/psd", emulation.address["psd"]["port"])
        path = tmp_path_factory.mktemp("site") / "rig.toml"
        path.write_text(text.replace("out/emulated/can", emulation.address["can"]["channel"]))
        yield path


def test_the_beam_is_centred_where_asked_and_every_step_is_kept(rig: Path, tmp_path: Path, capsys) -> None:
    """The second centring begins where the first one ended, in light: by the other law, to other spots."""
    ways = (["--aim"], ["--centring", "measured", "--spots-mm", "2", "-1", "0.5", "3"])
    for number, more in enumerate(ways):
        out = tmp_path / f"{number}.mcap"
        assert run(["centre", str(rig), "--out", str(out), "--time-scale", str(PACE), "--yes", *more]) == 0
        assert "within the tolerance" in capsys.readouterr().out
        last = [event.detail for event in read(out).events if event.kind == "centring"][-1]
        assert np.allclose(last["spots_m"][-1], last["target_m"], atol=5e-6)
    assert last["strategy"] == "measured"
    said = (tmp_path / "1.log").read_text()
    assert 'INFO acquisition.recording.mcap.writer: centring {"placement":1' in said
    assert "robot: connected" in said
    assert "recording closed" in said
    assert last["target_m"] == pytest.approx([2e-3, -1e-3, 0.5e-3, 3e-3])


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--first", "3"], "is 1 or 2"),
        (["--spots-mm", "0", "0", "99", "0"], "outside the face"),
        (["--tolerance-um", "0"], "above 0"),
        (["--placement", "99"], "the rig has"),
        (["--gain", "0.3"], "only law8 has a gain"),
        (["--centring", "law8", "--gain", "2"], "up to 1"),
    ],
)
def test_what_makes_no_sense_is_refused_before_any_line_is_opened(tmp_path: Path, capsys, more, says) -> None:
    assert run(["centre", str(RIG), "--out", str(tmp_path / "x.mcap"), "--yes", *more]) == 1
    assert says in capsys.readouterr().err
    assert not (tmp_path / "x.mcap").exists()


def test_ctrl_c_ends_it_with_what_was_recorded(tmp_path: Path, capsys, monkeypatch) -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(centre, "connected", pressed)
    out = tmp_path / "x.mcap"
    assert run(["centre", str(RIG), "--out", str(out), "--yes"]) == 3
    assert f"stopped: Ctrl-C; the arm stands, the steps until then are in {out}" in " ".join(
        capsys.readouterr().err.split()
    )
    assert not read(out).events
