"""[camera] of a rig file: what it takes, and what is refused with line and remedy."""

from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import parse_rig

TEXT = (Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd-camera.toml").read_text()
SOURCE = 'source = "http://127.0.0.1:8071/image.jpg"'


@pytest.mark.parametrize(("written", "read"), [("source = 0", 0), ('source = "rtsp://camera/1"', "rtsp://camera/1")])
def test_the_source_is_a_number_or_a_text(written: str, read: int | str) -> None:
    rig = parse_rig(TEXT.replace(SOURCE, written), "rig.toml")
    assert rig.camera is not None
    assert rig.camera.source == read


@pytest.mark.parametrize(
    ("before", "after", "why"),
    [
        ("view_rad = 1.13", 'view_rad = "180 deg"', r"view_rad = 3\.14.* in \[camera\]"),
        ("side_m = 0.018", "size_m = 0.018", r"unknown key 'size_m' in \[camera\.board\]; did you mean 'side_m'"),
        ('dictionary = "aruco-4x4-50"', 'dictionary = "aruco"', r"dictionary = 'aruco' in \[camera\.board\]"),
        ("source =", "sorce =", r"unknown key 'sorce' in \[camera\]; did you mean 'source'"),
    ],
)
def test_what_cannot_be_is_named_with_its_line(before: str, after: str, why: str) -> None:
    with pytest.raises(RigFileError, match=rf"rig\.toml line \d+: {why}"):
        parse_rig(TEXT.replace(before, after, 1), "rig.toml")


def test_a_board_needs_the_fixture_that_it_is_on() -> None:
    text = TEXT.replace("[fixture]\n", "").replace("half_size_m = 0.010\n", "")
    text = "\n".join(
        line for line in text.splitlines() if not line.startswith(("psd2_in_psd1", "psd1_in_base", "id = "))
    )
    text = text.replace("[[placement]]", "")
    with pytest.raises(RigFileError, match=r"\[camera\.board\].*no \[fixture\]; add it"):
        parse_rig(text, "rig.toml")
