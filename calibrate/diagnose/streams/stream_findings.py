"""What the finders found, as findings with the words of docs/formats.md."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibrate.diagnose.assess.diagnosis import Named
from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.angle_offsets import AngleOffset, OffsetStretch
from calibrate.diagnose.streams.clock_faults import Late
from calibrate.diagnose.streams.continuity import Break, Fault
from calibrate.diagnose.streams.deflection import Deflection
from calibrate.diagnose.streams.following import Following
from calibrate.diagnose.streams.ringing import Ringing
from calibrate.diagnose.streams.settling import Unsettled, Window
from calibrate.diagnose.streams.slips import Slip
from calibrate.diagnose.streams.track import Outcome, Track
from calibrate.model.effects.term import Size, with_sigma
from calibrate.quantities import angle_with_sigma


@dataclass(frozen=True)
class StreamFinding:
    """One cause in a stream. `p`: of nothing at all looking like this; times on the clock of the named stream."""

    name: Named
    stream: str
    outcome: Outcome
    parameters: Mapping[str, Size]
    from_s: float | None
    to_s: float | None
    p: float
    says: str
    rivals: tuple[Named, ...] = ()


SAID = {
    Fault.MISSED: "{n} samples of {stream} are missing at {at}",
    Fault.DUPLICATED: "{n} samples of {stream} came twice at {at}",
    Fault.BACKWARDS: "the clock of {stream} went back by {jump} s at {at}",
    Fault.STEPPED: "the clock of {stream} was set forward by {jump} s at {at}",
    Fault.FROZEN: "{n} samples of {stream} are one and the same{of}, while it moved, at {at}",
}
CERTAIN = float(np.finfo(float).tiny)  # of what was counted: no noise does it, and no probability is zero


def break_findings(track: Track, faults: Sequence[Break]) -> list[StreamFinding]:
    """One finding for each kind of fault and each joint that it struck, however often."""
    kinds: dict[tuple[Fault, str, str], list[Break]] = {}
    for one in faults:
        where, of = "time", ""
        if one.fault is Fault.FROZEN and track.name in ("joints", "encoders") and one.channels:
            where = f"joint{track.joint(one.channels[0])}.angle"
            of = " at joint " + ", ".join(str(track.joint(c)) for c in one.channels)
        kinds.setdefault((one.fault, where, of), []).append(one)
    return [_break_finding(track, *kind, alike) for kind, alike in kinds.items()]


def _break_finding(track: Track, fault: Fault, where: str, of: str, alike: list[Break]) -> StreamFinding:
    worst = max(alike, key=lambda one: (one.samples, abs(one.jump_s)))
    n, places = sum(one.samples for one in alike), len(alike)
    at = f"{alike[0].from_s:.3f} s" + (f" and {places - 1} more times, most at {worst.from_s:.3f} s" * (places > 1))
    says = SAID[fault].format(n=n, stream=track.name, at=at, of=of, jump=f"{abs(worst.jump_s):.6g}")
    sizes = {"samples_count": Size(float(n), 0.0), "places_count": Size(float(places), 0.0)}
    if fault in (Fault.BACKWARDS, Fault.STEPPED):
        sizes = {"jump_s": Size(worst.jump_s, track.period_s), "places_count": sizes["places_count"]}
    name = Named(where, ("t",), "step", None, fault.value)
    return StreamFinding(name, track.name, Outcome.FOUND, sizes, alike[0].from_s, alike[-1].to_s, CERTAIN, says)


def late_finding(device: str, late: Late, joints: int) -> StreamFinding:
    sizes = {"latency_s": Size(late.late_s, late.sigma_s)}
    way = "later" if late.late_s >= 0.0 else "earlier"
    says = f"{device} carry times {with_sigma(1e3 * abs(late.late_s), 1e3 * late.sigma_s)} ms {way} than the joints'"
    if late.drift is not None and late.drift_sigma is not None:
        sizes["drift_s_per_s"] = Size(late.drift, late.drift_sigma)
        if late.drifts:
            says += f"; their clocks drift by {with_sigma(1e6 * late.drift, 1e6 * late.drift_sigma)} µs/s"
    name = Named("time", tuple(f"qd{i + 1}" for i in range(joints)), "linear", None, "latency")
    return StreamFinding(name, device, Outcome.FOUND, sizes, None, None, max(late.p, CERTAIN), says)


def unsettled_finding(track: Track, windows: Sequence[Window], each: Sequence[Unsettled], joints: int) -> StreamFinding:
    """Of those that were found unsettled, all together. ValueError for none."""
    found = [(k, window, one) for k, (window, one) in enumerate(zip(windows, each, strict=True)) if _is_found(one)]
    if not found:
        raise ValueError(f"{track.name}: no sample was taken unsettled")
    share = np.array([one.left_share for _, _, one in found if one.left_share is not None])
    tau_s = np.array([one.tau_s for _, _, one in found if one.tau_s is not None])
    largest = max(float(np.max(np.abs(one.missing))) for _, _, one in found if one.missing is not None)
    sizes = {"samples_count": Size(float(len(found)), 0.0), f"missing_{track.unit}": Size(largest, _sigma(found[0][2]))}
    for name, values in (("left_share", share), ("tau_s", tau_s)):
        if len(values):
            sizes[name] = Size(float(np.median(values)), float(np.std(values) / np.sqrt(len(values))))
    rows = ", ".join(str(k + 1) for k, _, _ in found[: limits.PRINTED_ROWS]) + (
        ", ..." if len(found) > limits.PRINTED_ROWS else ""
    )
    says = (
        f"{len(found)} of {len(windows)} samples (rows {rows}) were taken before the arm had settled: "
        f"up to {1e6 * largest:.3g} µ{track.unit} of the {track.name} were still to come"
    )
    moves = tuple(f"last_move{i + 1}" for i in range(joints))
    name = Named("time", moves, "linear", None, "not-settled")
    p = max(min(one.p for _, _, one in found), CERTAIN)
    from_s, to_s = found[0][1].from_s, found[-1][1].to_s
    return StreamFinding(name, track.name, Outcome.FOUND, sizes, from_s, to_s, p, says)


def _is_found(one: Unsettled) -> bool:
    return one.outcome is Outcome.FOUND and one.missing is not None


def _sigma(one: Unsettled) -> float:
    return 0.0 if one.sigma is None else float(np.max(one.sigma))


def following_finding(one: Following) -> StreamFinding:
    name = Named(f"joint{one.joint}.angle", (f"qd{one.joint}",), "linear", None, "following-error")
    gain = "" if one.velocity_gain_per_s is None else f" (velocity gain {one.velocity_gain_per_s:.4g} 1/s)"
    kind = "" if one.kind == "undetermined" else f", like a {one.kind}"
    way = "behind" if (one.behind_s or 0.0) >= 0.0 else "ahead of"
    says = f"the reading of joint {one.joint} is {_ms(one)} ms {way} its set-point{gain}{kind}"
    return StreamFinding(name, "joints", Outcome.FOUND, _behind(one), None, None, max(one.p, CERTAIN), says)


def reading_lag_finding(one: Following) -> StreamFinding:
    name = Named(f"joint{one.joint}.angle", (f"qd{one.joint}",), "linear", None, "reading-lag")
    kind = "" if one.kind == "undetermined" else f", like a {one.kind}"
    way = "later" if (one.behind_s or 0.0) >= 0.0 else "earlier"
    says = f"the encoder of joint {one.joint} reads {_ms(one)} ms {way} than those of the other joints{kind}"
    return StreamFinding(name, "encoders", Outcome.FOUND, _behind(one), None, None, max(one.p, CERTAIN), says)


def deflection_finding(one: Deflection) -> StreamFinding:
    """ValueError where nothing was found."""
    if one.compliance is None or one.sigma is None:
        raise ValueError(f"joint {one.joint}: no deflection ({one.outcome.value})")
    name = Named(f"joint{one.joint}.angle", (f"tau{one.joint}",), "linear", None, "joint-compliance")
    stiffness = 1.0 / one.compliance
    sizes = {
        "compliance_rad_per_nm": Size(one.compliance, one.sigma),
        "stiffness_nm_per_rad": Size(stiffness, one.sigma * stiffness**2),
    }
    says = (
        f"the two encoders of joint {one.joint} differ by {with_sigma(1e6 * one.compliance, 1e6 * one.sigma)} µrad/Nm: "
        f"stiffness {with_sigma(1e-3 * stiffness, 1e-3 * one.sigma * stiffness**2)} kNm/rad; on seconds that the fit "
        f"has not seen {1e6 * one.unseen_after_rad:.0f} µrad (rms) are left, "
        f"{1e6 * one.unseen_before_rad:.0f} without it"
    )
    return StreamFinding(name, "encoders", Outcome.FOUND, sizes, None, None, max(one.p, CERTAIN), says)


def slip_finding(one: Slip) -> StreamFinding:
    name = Named(f"joint{one.joint}.angle", ("t",), "step", None, "encoder-slip")
    sizes = {"slip_rad": Size(one.size_rad, one.sigma_rad), "time_s": Size(one.to_s, one.to_s - one.from_s)}
    says = (
        f"the encoder of joint {one.joint} slipped by {1e6 * one.size_rad:+.1f} ± {1e6 * one.sigma_rad:.1f} µrad "
        f"between {one.from_s:.3f} and {one.to_s:.3f} s"
    )
    return StreamFinding(name, "encoders", Outcome.FOUND, sizes, one.from_s, one.to_s, max(one.p, CERTAIN), says)


OFFSET, DROOP, ECCENTRIC = "angle-offset", "droop", "encoder-eccentricity"
AGAINST = {"joints": "its set-point", "encoders": "the joint's reading"}


def offset_findings(stream: str, one: AngleOffset) -> list[StreamFinding]:
    """Of one joint: the offset of each stretch that has one, or its change, and the droop."""
    changes = len(one.stretches) > 1
    shown = one.stretches[1:] if one.zeroless else [s for s in one.stretches if s.found]
    if changes and not shown:
        shown = one.stretches[1:]
    found = [_offset_finding(stream, one, stretch, changes=changes) for stretch in shown] if _decides(one) else []
    return found if one.droop is None else [*found, _droop_finding(stream, one, one.droop)]


def _decides(one: AngleOffset) -> bool:
    return len(one.stretches) > 1 or any(stretch.found for stretch in one.stretches)


def _offset_finding(stream: str, one: AngleOffset, stretch: OffsetStretch, *, changes: bool) -> StreamFinding:
    name = Named(f"joint{one.joint}.angle", ("t" if changes else "recording",), "constant", None, OFFSET)
    size, which = stretch.offset, "offset_rad"
    if one.zeroless:  # its own beginning is the zero
        first = one.stretches[0].offset
        change = (size.value - first.value + np.pi) % (2.0 * np.pi) - np.pi
        size = Size(float(change), float(np.hypot(size.sigma, first.sigma)))
        which = "change_rad"
    when = f" between {stretch.from_s:.2f} and {stretch.to_s:.2f} s" if changes else ""
    since = " than at the beginning" if one.zeroless else f" than {AGAINST[stream]} whatever the motion"
    way = "more" if size.value >= 0.0 else "less"
    says = (
        f"the reading of joint {one.joint} in {stream} shows {angle_with_sigma(abs(size.value), size.sigma)} {way}"
        f"{when}{since}"
    )
    ends = (stretch.from_s, stretch.to_s) if changes else (None, None)
    return StreamFinding(name, stream, Outcome.FOUND, {which: size}, *ends, CERTAIN, says)


def _droop_finding(stream: str, one: AngleOffset, size: Size) -> StreamFinding:
    """Where the joint's own angle explains it, a disc off its centre may, too, between two encoders."""
    where, turn = f"joint{one.joint}.angle", (f"q{one.joint}",)
    own = Named(where, turn, "harmonic", 1, DROOP)
    name = Named(where, (f"gravity_torque{one.joint}",), "linear", None, DROOP) if one.by_gravity else own
    rivals = (Named(where, turn, "harmonic", 1, ECCENTRIC),) if stream == "encoders" and not one.by_gravity else ()
    by = "as gravity turns the joint" if one.by_gravity else "with one turn of sine of its own angle"
    says = (
        f"the reading of joint {one.joint} in {stream} sags from {AGAINST[stream]} by up to "
        f"{angle_with_sigma(size.value, size.sigma)} {by}"
    )
    return StreamFinding(name, stream, Outcome.FOUND, {"droop_rad": size}, None, None, CERTAIN, says, rivals)


def ringing_finding(track: Track, one: Ringing) -> StreamFinding:
    """ValueError where nothing rings."""
    if one.frequency_hz is None or one.damping is None or one.amplitude is None:
        raise ValueError(f"{track.name}: nothing rings ({one.outcome.value})")
    where = "base.pose" if one.joint is None else f"joint{one.joint}.angle"
    name = Named(where, ("t",), "harmonic", None, "ringing")
    others = tuple(Named(f"joint{i}.angle", ("t",), "harmonic", None, "ringing") for i in one.rivals)
    sizes = {
        "frequency_hz": Size(one.frequency_hz, one.frequency_sigma_hz or 0.0),
        "damping_share": Size(one.damping, one.damping_sigma or 0.0),
        f"amplitude_{track.unit}": Size(one.amplitude, 0.0),
    }
    place = "no single joint explains it: base, link or tool" if one.joint is None else f"it is joint {one.joint}"
    says = (
        f"{track.name} ring on after {one.stops} stops with {one.frequency_hz:.3g} Hz, "
        f"damping {100 * one.damping:.2g} %, up to {1e6 * one.amplitude:.3g} µ{track.unit}; {place}"
    )
    return StreamFinding(name, track.name, Outcome.FOUND, sizes, one.from_s, None, max(one.p, CERTAIN), says, others)


def _ms(one: Following) -> str:
    return with_sigma(1e3 * abs(one.behind_s or 0.0), 1e3 * (one.behind_sigma_s or 0.0))


def _behind(one: Following) -> dict[str, Size]:
    return {
        "behind_s": Size(one.behind_s or 0.0, one.behind_sigma_s or 0.0),
        "by_acceleration_s2": Size(one.by_acceleration_s2 or 0.0, one.by_acceleration_sigma_s2 or 0.0),
    }
