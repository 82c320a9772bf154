"""Whole sessions: readable, repeatable, sealed, and with the effect over noise that was asked for."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.session_folder import read_folder
from simulators.conceal.__main__ import main
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.observe import seated_tip_m
from simulators.conceal.wanted import FAMILIES, KINDS, ConcealError, Family, Wanted, draw_noise

SMALL = {"samples": 100, "places": 3}


def written(case: Case, folder: Path) -> tuple[str, str, dict]:
    write_case(case, folder)
    recording = folder / "recording"
    truth = json.loads((folder / "sealed" / "truth.json").read_text())
    return (recording / "rig.toml").read_text(), (recording / "samples.csv").read_text(), truth


@pytest.mark.parametrize("family", FAMILIES)
def test_a_folder_reads_cleanly_and_holds_nothing_of_the_truth(family: Family, tmp_path: Path) -> None:
    case = conceal(Wanted(family, seed=11, defects=("encoder-eccentricity", "worn-bearing"), **SMALL))
    rig, table, truth = written(case, tmp_path)
    read = read_folder(tmp_path / "recording")
    assert len(read.samples) == len(case.table.pose) >= 80
    assert sorted(path.name for path in (tmp_path / "recording").iterdir()) == ["rig.toml", "samples.csv"]
    for secret in ("eccentric", "wobble", "seed", "enr", "truth", "defect"):
        assert secret not in (rig + table.splitlines()[0]).lower()
    assert [one["physics"] for one in truth["defects"]] == ["encoder-eccentricity", "axis-wobble"]


@pytest.mark.parametrize("family", FAMILIES)
def test_one_seed_gives_one_recording(family: Family, tmp_path: Path) -> None:
    wanted = Wanted(family, seed=12, defects=("encoder-slip",), **SMALL)
    once, again = written(conceal(wanted), tmp_path / "a"), written(conceal(wanted), tmp_path / "b")
    assert once == again
    other = written(conceal(Wanted(family, seed=13, defects=("encoder-slip",), **SMALL)), tmp_path / "c")
    assert other[1] != once[1]


@pytest.mark.parametrize("family", ["dual-psd", "tracker", "wire"])
@pytest.mark.parametrize("kind", KINDS)
def test_without_a_defect_only_noise_is_left(family: Family, kind) -> None:
    case = conceal(Wanted(family, seed=14, noise=kind, **SMALL))
    left = (case.values_m - case.exact.values_m) / case.sigma_m
    assert not case.hidden
    assert np.median(np.abs(left)) / 0.6745 == pytest.approx(1.25 if kind == "wandering" else 0.9, abs=0.3)


def test_a_probe_without_a_defect_stays_in_its_seat_to_the_noise() -> None:
    case = conceal(Wanted("cones", seed=15, **SMALL))
    seat_m = case.drawn.true.instrument.seat_m[case.table.scene.seat - 1]
    np.testing.assert_allclose(seated_tip_m(case.drawn.true, case.exact.reading_rad), seat_m, atol=1e-10)
    off_m = seated_tip_m(case.drawn.true, case.reading_rad) - seat_m
    assert 0.8 * case.sigma_m < np.sqrt(np.mean(off_m**2)) < 4.0 * case.sigma_m


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("enr", [0.2, *(pytest.param(enr, marks=pytest.mark.endure) for enr in (1.0, 3.0))])
def test_the_effect_is_as_strong_as_asked(family: Family, enr: float) -> None:
    hidden = conceal(Wanted(family, seed=16, defects=("encoder-eccentricity",), enr=enr, **SMALL)).hidden[0]
    assert hidden.enr == pytest.approx(enr, rel=0.02)
    assert hidden.raw > hidden.enr


def test_what_the_scale_of_the_arm_imitates_has_no_strength() -> None:
    hidden = conceal(Wanted("tracker", seed=17, defects=("tracker-scale",), **SMALL)).hidden[0]
    assert hidden.enr < 0.05
    assert hidden.raw > 1.0


def test_a_withheld_column_is_not_in_the_table(tmp_path: Path) -> None:
    case = conceal(Wanted("tracker", seed=18, defects=("late-clock",), withhold=True, **SMALL))
    _, table, truth = written(case, tmp_path)
    assert truth["withheld"] == ["qd"]
    assert "qd1_rad_s" not in table.splitlines()[0]
    shown = written(conceal(Wanted("tracker", seed=18, defects=("late-clock",), **SMALL)), tmp_path / "shown")[1]
    assert "qd1_rad_s" in shown.splitlines()[0]


def test_many_defects_sit_at_ports_or_drivers_of_their_own() -> None:
    case = conceal(Wanted("dual-psd", seed=19, defects=("any",) * 18, samples=160, places=3))
    assert len(case.hidden) == 18
    assert max(Counter((one.defect.port, one.defect.drivers) for one in case.hidden).values()) == 1
    assert all(one.enr > 0.05 for one in case.hidden)


def test_truth_of_free_space_is_that_of_the_true_arm(tmp_path: Path) -> None:
    case = conceal(Wanted("tracker", seed=20, **SMALL))
    free = written(case, tmp_path)[2]["free_space"]
    np.testing.assert_allclose(seated_tip_m(case.drawn.true, np.array(free["reading_rad"])), free["tip_m"], atol=1e-12)
    bent = conceal(Wanted("tracker", seed=20, defects=("soft-joint",), enr=3.0, **SMALL))
    other = written(bent, tmp_path / "bent")[2]["free_space"]
    assert other["reading_rad"] == free["reading_rad"]
    assert np.abs(np.array(other["tip_m"]) - free["tip_m"]).max() > 1e-5


def test_rows_of_one_repeat_group_repeat_the_pose() -> None:
    case = conceal(Wanted("tracker", seed=21, **SMALL))
    group = case.table.repeat
    counts = Counter(group[group > 0].tolist())
    assert set(counts.values()) == {4}
    assert len(counts) == 15
    for number in counts:
        assert np.ptp(case.reading_rad[group == number], axis=0).max() == 0.0


def test_ends_of_a_bar_follow_each_other(tmp_path: Path) -> None:
    for seed in range(10):
        case = conceal(Wanted("cones", seed=seed, **SMALL))
        if case.drawn.true.instrument.bar_m.size:
            break
    write_case(case, tmp_path)
    samples = read_folder(tmp_path / "recording").samples
    ends = [end for end in samples.columns["bar_end"].tolist() if end]
    assert ends == ["a", "b"] * (len(ends) // 2)
    rows = np.flatnonzero(samples.columns["bar_end"] != "")
    assert (rows[1::2] - rows[::2] == 1).all()


def test_noise_has_the_character_it_is_named_for() -> None:
    rng = np.random.default_rng(1)
    heavy, wander = draw_noise("heavy", 4000, 2, rng), draw_noise("wandering", 4000, 2, rng)
    far = np.linalg.norm(heavy, axis=1) > 5.9
    assert 0.01 < far.mean() < 0.05
    smooth = wander - wander.mean(axis=0)
    following = np.mean(smooth[1:] * smooth[:-1]) / np.mean(smooth**2)
    assert following == pytest.approx(0.95 * 0.5625 / 1.5625, abs=0.06)


def test_what_cannot_be_hidden_is_refused_by_name() -> None:
    with pytest.raises(ConcealError, match=r"psd-gain.*cannot be hidden"):
        conceal(Wanted("tracker", seed=1, defects=("psd-gain",), **SMALL))
    with pytest.raises(ConcealError, match="arm 'puma' is not known"):
        conceal(Wanted("tracker", seed=1, arm="puma", **SMALL))


def test_the_command_writes_both_folders_and_lists_the_mechanisms(tmp_path: Path, capsys) -> None:
    out = tmp_path / "case"
    asked = "--family tracker --samples 90 --defect soft-joint --seed 7 --out"
    assert main([*asked.split(), str(out)]) == 0
    assert (out / "recording" / "samples.csv").is_file()
    assert (out / "sealed" / "truth.json").is_file()
    assert main(["--list"]) == 0
    assert "soft-joint" in capsys.readouterr().out
