"""What each recording's streams show, side by side."""

from calibrate.compare.streams import stream_differences
from calibrate.diagnose.assess.diagnosis import Named
from calibrate.diagnose.streams.examine import StreamReport
from calibrate.diagnose.streams.stream_findings import StreamFinding
from calibrate.diagnose.streams.track import Outcome
from calibrate.model.effects.term import Size


def report(*found):
    return StreamReport(
        tuple(
            StreamFinding(
                Named(where, ("qd",), "linear", None, physics), "joints", Outcome.FOUND, sizes, 0.0, 1.0, 1e-9, ""
            )
            for where, physics, sizes in found
        ),
        {},
        (),
        (),
        (),
    )


def lag(behind_s, sigma_s=1e-5, joint=3):
    return f"joint{joint}.angle", "following-error", {"behind_s": Size(behind_s, sigma_s)}


def test_alike_properties_are_no_difference():
    assert stream_differences(report(lag(5.00e-3)), report(lag(5.02e-3))) == ()


def test_another_size_and_what_only_one_shows_are():
    ringing = "joint2.angle", "ringing", {"frequency_hz": Size(12.0, 0.1)}
    size, alone = stream_differences(report(lag(5e-3), ringing), report(lag(8e-3)))
    assert (size.measured.value, size.simulated.value) == (5e-3, 8e-3)
    assert (alone.name.physics, alone.simulated) == ("ringing", None)


def test_samples_lost_on_a_line_are_no_property_of_a_machine():
    lost = "time", "missing-samples", {"samples_count": Size(3.0, 0.0)}
    assert stream_differences(report(lost), report()) == ()


def test_without_streams_on_one_side_nothing_is_compared():
    assert stream_differences(report(lag(5e-3)), None) == ()
