"""The files of a concealed session: `recording` as a site would hand it over, `sealed` with the truth.

`recording` holds samples.csv and rig.toml. truth.json in `sealed` holds everything that was hidden, and the readings of
an exact instrument.

Beside it, if asked for, the same plan by a simulation: the nominal arm of the rig file, with or without mechanisms. The
measured arm is the nominal one, too, but for constants by which it is off.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import fixed_parts
from simulators.arm.kinematics import forward
from simulators.conceal.case import Case, HiddenMechanism, add_noise
from simulators.conceal.effect_over_noise import STEP, list_deviations
from simulators.conceal.observe import at_the_flange, observe
from simulators.conceal.poses import free_poses
from simulators.conceal.readings import stand, tip_m
from simulators.conceal.rig import ENCODER_RAD, Artefacts, Device, DualPsd, TrueRig
from simulators.conceal.rig_file import pose_record, rig_document, toml_text
from simulators.conceal.wanted import ConcealError
from simulators.defects import Defect, Scene
from simulators.defects.drive import WrongLoadCentre

Floats = NDArray[np.float64]
FREE_POSES = 200
SEED_OF_GRID = 20260101  # the same unseen poses for every case of one arm


def truth_document(case: Case) -> dict[str, Any]:
    """Defects, geometry, noise, noise-free readings, and poses over the workspace that nobody measured."""
    return {
        "schema": 1,
        "wanted": asdict(case.wanted),
        "defects": [_defect(one) for one in case.hidden] + ([_convention(case)] if case.wanted.confused else []),
        "constants": [_constant(name, case.off[name], enr) for name, enr in over_noise_of(case).items()],
        "withheld": list(case.withheld),
        "noise": {
            "kind": case.wanted.noise,
            "sigma_m": case.sigma_m,
            "encoder_sigma_rad": ENCODER_RAD if case.wanted.family == "cones" else 0.0,
            "rms_m": float(np.sqrt(np.mean((case.values_m - case.exact.values_m) ** 2))),
        },
        "payload_kg": sorted(set(case.table.scene.payload_kg.tolist())),
        "payload_com_m": case.table.scene.payload_com_m.tolist(),
        "rig": _rig(case.drawn.true),
        "exact": {"readings_rad": case.exact.reading_rad.tolist(), "values_m": case.exact.values_m.tolist()},
        "free_space": _free_space(case),
    }


def _defect(one: HiddenMechanism) -> dict[str, Any]:
    defect = one.defect
    return {
        "mechanism": defect.KIND,
        "physics": defect.PHYSICS,
        "port": defect.port,
        "drivers": list(defect.drivers),
        "needs": list(defect.needs),
        "size_field": defect.SIZE,
        "fields": dict(vars(defect)),
        "figures": dict(defect.figures),
        "also": list(defect.ALSO),
        "enr": one.enr,
        "enr_before_geometry": one.raw,
    }


def _constant(name: str, by: float, enr: float) -> dict[str, Any]:
    """A number of the arm by which it is off, as a cause."""
    owner, _, what = name.partition(".")
    zero = what == "zero"
    unit = "m" if what in ("length", "offset") else "rad"
    named = {"mechanism": f"{what}-off", "physics": "joint-zero-moved" if zero else "link-changed"}
    named |= {"port": f"{owner}.angle" if zero else name, "drivers": [], "figures": {f"{what}_{unit}": by}}
    return named | {"enr": enr}


def _convention(case: Case) -> dict[str, Any]:
    """A table under the name of the wrong convention, as a cause: its size is how far it puts the flange off."""
    arm = case.drawn.true.arm
    stated, true = (
        forward(replace(arm, fixed=fixed), case.table.scene.goal_rad + arm.zero_rad).flange[:, :3, 3]
        for fixed in (fixed_parts(case.drawn.drawing), arm.fixed)
    )
    off_m = float(np.sqrt(np.mean((stated - true) ** 2)))
    named = {"mechanism": "confused-convention", "physics": "rig-convention", "port": "arm.model"}
    return named | {"drivers": [], "figures": {}, "enr": off_m / case.sigma_m}


def _rig(rig: TrueRig) -> dict[str, Any]:
    arm, instrument = rig.arm, rig.instrument
    document: dict[str, Any] = {
        "link": [pose_record(part) for part in arm.fixed],
        "zero_rad": arm.zero_rad.tolist(),
        "mass_kg": arm.mass_kg.tolist(),
        "com_turning_m": arm.com_m.tolist(),
        "tool_kg": arm.tool_kg,
        "tool_com_m": arm.tool_com_m.tolist(),
        "tool_point_m": rig.tool_point_m.tolist(),
    }
    if isinstance(instrument, DualPsd):
        document |= {
            "laser_origin_m": instrument.laser_origin_m.tolist(),
            "laser_direction": instrument.laser_direction.tolist(),
            "psd2_in_psd1": pose_record(instrument.psd2_in_psd1),
            "psd1_in_base": [pose_record(place) for place in instrument.places],
        }
    elif isinstance(instrument, Device):
        document["device"] = pose_record(instrument.pose)
    else:
        document["seat_m"] = instrument.seat_m.tolist()
    return document


def _free_space(case: Case) -> dict[str, Any]:
    """Unseen poses at the start of the session: encoder readings, approach, and where the tool truly is."""
    rng = np.random.default_rng(SEED_OF_GRID)
    reading_rad = free_poses(case.drawn.nominal.arm, FREE_POSES, rng)
    scene = at_start(case.table.scene, reading_rad, rng)
    true = case.drawn.true
    defects = [one.defect for one in case.hidden]
    felt = defects if case.wanted.encoders is None else at_the_flange(defects, case.wanted.encoders)
    stance = stand(true, scene, felt, reading_rad)
    found: dict[str, Any] = {
        "reading_rad": reading_rad.tolist(),
        "approach": np.sign(scene.last_move_rad).astype(int).tolist(),
    }
    instrument = true.instrument
    if isinstance(instrument, DualPsd):
        tool = stance.T_base_tool
        origin_m = tool[:, :3, :3] @ instrument.laser_origin_m + tool[:, :3, 3]
        return found | {
            "beam_origin_m": origin_m.tolist(),
            "beam_direction": (tool[:, :3, :3] @ instrument.laser_direction).tolist(),
        }
    return found | ({"tip_m": tip_m(true, stance).tolist()} if case.target is None else {})


def at_start(scene: Scene, reading_rad: Floats, rng: np.random.Generator) -> Scene:
    """Other poses under the conditions of the first sample: standing, unloaded, nothing warm."""
    rows = len(reading_rad)

    def held(values: Floats) -> Floats:
        return np.full(rows, values[0])

    return replace(
        scene,
        t_s=np.zeros(rows),
        via_rad=reading_rad - rng.choice([-1.0, 1.0], reading_rad.shape) * 0.05,
        goal_rad=reading_rad,
        qd_rad_s=np.zeros_like(reading_rad),
        wait_s=np.full(rows, 60.0),
        payload_kg=np.zeros(rows),
        placement=np.zeros(rows, dtype=np.int64),
        first_psd=np.zeros(rows, dtype=np.int64),
        seat=np.zeros(rows, dtype=np.int64),
        temperature_degC={where: held(values) for where, values in scene.temperature_degC.items()},
        laser_power=np.ones(rows),
        extra={name: held(values) for name, values in scene.extra.items()},
    )


Column = Sequence[float | int | str | None]
THERMOMETER_K = 0.05  # one sigma of a cheap probe


def session_columns(
    scene: Scene,
    reading_rad: Floats,
    repeat: NDArray[np.int64],
    recorded: frozenset[str],
    rng: np.random.Generator,
    artefacts: Artefacts | None = None,
) -> dict[str, Column]:
    """Everything but the instrument's own columns. `recorded`: "approach", "qd", "cmd", "payload_kg", "temp_..."."""
    n = reading_rad.shape[1]
    columns: dict[str, Column] = {"t_s": scene.t_s.tolist()}
    columns |= {f"q{joint + 1}_rad": reading_rad[:, joint].tolist() for joint in range(n)}
    if scene.placement.any():
        columns |= {"placement": scene.placement.tolist(), "first_psd": scene.first_psd.tolist()}
    if artefacts is not None:
        columns |= _seats(scene, artefacts)
    if repeat.any():
        columns["repeat"] = [number or None for number in repeat.tolist()]
    if "approach" in recorded:
        sign = np.sign(np.round(scene.last_move_rad, 9)).astype(np.int64)
        columns |= {f"approach{joint + 1}": sign[:, joint].tolist() for joint in range(n)}
    if "qd" in recorded:
        columns |= {f"qd{joint + 1}_rad_s": scene.qd_rad_s[:, joint].tolist() for joint in range(n)}
    if "cmd" in recorded:
        columns |= {f"cmd{joint + 1}_rad": scene.goal_rad[:, joint].tolist() for joint in range(n)}
    if "payload_kg" in recorded:
        columns["payload_kg"] = scene.payload_kg.tolist()
    for name in sorted(recorded):
        if name.startswith("temp_"):
            degC = scene.temperature_degC[name.removeprefix("temp_").removesuffix("_degC")]
            columns[name] = np.round(degC + THERMOMETER_K * rng.standard_normal(len(scene)), 3).tolist()
        elif name in scene.extra:
            columns[name] = np.round(scene.extra[name], 6).tolist()
    return columns


def _seats(scene: Scene, artefacts: Artefacts) -> dict[str, Column]:
    """Cones by number; ends of bars by bar and end."""
    end = scene.seat - 1 - artefacts.cones
    at_bar = end >= 0
    columns: dict[str, Column] = {
        "seat": [None if bar else seat for seat, bar in zip(scene.seat.tolist(), at_bar, strict=True)]
    }
    if at_bar.any():
        number = [int(artefacts.held[e // 2]) + 1 if e >= 0 else None for e in end.tolist()]
        columns |= {"bar": number, "bar_end": ["ab"[e % 2] if e >= 0 else None for e in end.tolist()]}
    return columns


def csv_text(columns: Mapping[str, Column]) -> str:
    """Header and rows; a missing cell is empty."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, column) for column in columns.values()), strict=True))
    return text.getvalue()


def _cell(value: float | int | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else repr(value)


SUM_NOISE_V = 1e-3  # one sigma of a 12-bit converter over 5 V
VALUES = {
    "dual-psd": ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m"),
    "tracker": ("x_m", "y_m", "z_m"),
    "wire": ("wire_m",),
    "cones": (),
}


def write_case(case: Case, folder: Path) -> None:
    """Writes `folder`/recording/rig.toml and samples.csv, and `folder`/sealed/truth.json."""
    recording, sealed = folder / "recording", folder / "sealed"
    recording.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    (recording / "rig.toml").write_text(toml_text(rig_document(case.stated)), encoding="utf-8")
    (recording / "samples.csv").write_text(csv_text(columns(case)), encoding="utf-8", newline="")
    truth: dict[str, Any] = truth_document(case)
    (sealed / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def columns(case: Case) -> dict[str, Column]:
    """All columns of samples.csv."""
    instrument = case.drawn.true.instrument
    artefacts = instrument if isinstance(instrument, Artefacts) else None
    written = session_columns(case.table.scene, case.reading_rad, case.table.repeat, case.recorded, case.rng, artefacts)
    for one in case.hidden:
        if isinstance(one.defect, WrongLoadCentre):
            written |= one.defect.stated_columns(case.table.scene)
    for channel, name in enumerate(VALUES[case.wanted.family]):
        written[name] = case.values_m[:, channel].tolist()
    if case.target is not None:
        written["target"] = case.target.tolist()
    if case.turn_rad is not None:
        written |= {f"r{axis}_rad": said.tolist() for axis, said in zip("xyz", case.turn_rad.T, strict=True)}
    if case.second_rad is not None:
        written |= {f"enc{joint}_rad": said.tolist() for joint, said in enumerate(case.second_rad.T, start=1)}
    if case.exact.sum_v is not None:
        noisy_v = case.exact.sum_v + SUM_NOISE_V * case.rng.standard_normal(case.exact.sum_v.shape)
        for sensor, name in enumerate(("psd1_sum_v", "psd2_sum_v")):
            if name not in case.withheld:
                written[name] = noisy_v[:, sensor].tolist()
    return written


FIELDS = {"length": "a_m", "offset": "d_m", "twist": "alpha_rad"}
OFF = {"zero": 1e-3, "length": 1e-4, "offset": 1e-4, "twist": 2e-4}  # one sigma of a constant that is off, rad or m
OFF_SHARE = 0.5  # of the constants
PARALLEL = 1e-6  # 1 - cosine of two axes that a table of Denavit and Hartenberg cannot tilt against each other


@dataclass(frozen=True)
class Made:
    """One of two sessions. `off`: constants as model.json names them, "joint3.zero", "link2.length"."""

    off: Mapping[str, float]
    defects: tuple[Defect, ...] = ()


def made(case: Case, how: Made, seed: int) -> Case:
    """The plan of `case` with the nominal arm but for what is `made` of it."""
    true = _arm_off(case, how.off)
    exact = observe(true, case.table.scene, how.defects, case.posture_rad)
    reading_rad, values_m = add_noise(case.wanted, true, exact, case.sigma_m, np.random.default_rng(seed))
    return replace(
        case,
        drawn=replace(case.drawn, true=true),
        exact=exact,
        reading_rad=reading_rad,
        values_m=values_m,
        rng=np.random.default_rng(seed + 1),
        off=how.off,
    )


def pair_of(case: Case) -> tuple[Case, Case]:
    """Measured: off by constants; simulated: with what is hidden. ConcealError where the rig file has no rows."""
    if not case.drawn.drawing.rows:
        raise ConcealError("constants are drawn for arms in the notation of Denavit and Hartenberg; take another seed")
    rng = np.random.default_rng([case.wanted.seed, 51])
    off = {name: OFF[name.partition(".")[2]] * rng.standard_normal() for name in _constants(case)}
    measured = made(case, Made({k: by for k, by in off.items() if rng.random() < OFF_SHARE}), case.wanted.seed + 1)
    return measured, made(case, Made({}, tuple(one.defect for one in case.hidden)), case.wanted.seed + 3)


def _constants(case: Case) -> list[str]:
    """Of all joints and of every link that both notations have."""
    drawing = case.drawn.drawing
    inner = range(1, drawing.n_joints if drawing.model == "mdh" else drawing.n_joints + 1)
    names = [f"joint{joint}.zero" for joint in range(1, drawing.n_joints + 1)]
    return names + [f"link{link}.{what}" for link in inner for what in FIELDS]


def _arm_off(case: Case, off: Mapping[str, float]) -> TrueRig:
    """The assumed rig with these constants changed."""
    drawing, nominal = case.drawn.drawing, case.drawn.nominal
    rows, zero_rad = list(drawing.rows), np.zeros(drawing.n_joints)
    for name, by in off.items():
        owner, _, what = name.partition(".")
        row = int(owner[-1]) - 1
        if what == "zero":
            zero_rad[row] = by
        else:
            row += drawing.model == "mdh" and what != "offset"  # Craig's a and alpha come first
            rows[row] = replace(rows[row], **{FIELDS[what]: getattr(rows[row], FIELDS[what]) + by})
    fixed = fixed_parts(replace(drawing, rows=tuple(rows))) if off else nominal.arm.fixed
    return replace(nominal, arm=replace(nominal.arm, fixed=fixed, zero_rad=zero_rad))


def over_noise_of(case: Case) -> dict[str, float]:
    """Of each constant that is off: rms of what no other constant, tilt, tool or device can do, over the noise of two
    recordings.
    """
    if not case.off:
        return {}
    names, nominal = _constants(case), case.drawn.nominal

    def slope(ahead: TrueRig, behind: TrueRig) -> Floats:
        one, two = (observe(rig, case.table.scene, (), case.posture_rad).values_m for rig in (ahead, behind))
        return np.asarray((one - two).ravel() / (2.0 * STEP))

    columns = [slope(_arm_off(case, {name: STEP}), _arm_off(case, {name: -STEP})) for name in names]
    tilts = np.abs(nominal.arm.fixed[:, 2, 2]) > 1.0 - PARALLEL
    left_out = {f"link{k}.{axis}" for k, tilt in enumerate(tilts) for axis in range(6) if axis != 4 or not tilt}
    others = [one for one in list_deviations(nominal, case.drawn.spread) if one.name not in left_out]
    columns += [slope(one.apply(nominal, STEP), one.apply(nominal, -STEP)) for one in others]
    matrix = np.stack(columns, axis=1)
    unit = matrix / (np.linalg.norm(matrix, axis=0) + np.finfo(float).tiny)

    def over_noise(k: int, by: float) -> float:
        rest = np.delete(unit, k, axis=1)
        left = matrix[:, k] - rest @ np.linalg.lstsq(rest, matrix[:, k], rcond=1e-9)[0]
        return float(abs(by) * np.sqrt(0.5 * np.mean(left**2)) / case.sigma_m)

    return {name: over_noise(names.index(name), by) for name, by in case.off.items()}
