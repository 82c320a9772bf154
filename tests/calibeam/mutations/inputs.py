"""One small good file of every format, in one folder: arms of three joints and sessions of some 20 rows where possible.

What a command leaves of its mutated file, it works through, so a small file is what keeps thousands of runs affordable.
"""

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import msgspec
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from acquisition.recording import Channel, Event, Gap, RecordingWriter
from acquisition.recording.can_frames import block_of, channels
from acquisition.recording.can_log import frame_of
from acquisition.recording.rig import load_rig, rig_sha256, rig_text
from calibeam.fleet.recordings import find_recordings
from calibeam.fleet.row import Task
from calibeam.fleet.table import write_rows
from calibeam.fleet.worker import judge_recording
from calibeam.guided.recorded import AssumedGuidedArm
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.model_file import ModelFile, RigIdentity, write_model
from drivers.psd_error_map import ErrorMap
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Family, Wanted

Floats = NDArray[np.float64]
Run = Callable[[list[str]], int]

RIGS = Path(__file__).parents[3] / "rigs"
LINKS = [(0.0, np.pi / 2, 0.3), (0.4, 1.2, 0.0), (0.3, 0.3, 0.1)]  # a, alpha, d
POINT_M = np.array([0.031, -0.012, 0.052])
JOINT = "[[arm.joint]]\na_m = {}\nalpha_rad = {}\nd_m = {}\nlower_rad = -2.9\nupper_rad = 2.9\n"
FEW_ERRORS = (  # every kind of source once or twice, where the whole arm has 87
    ('"link*.x", "link*.y", "link*.z"', '"link1.*x", "link2.y"'),
    ('"link*.roll", "link*.pitch", "link*.yaw"', '"link1.roll", "link2.*w"'),
    ("joint*", "joint2"),
)
RIG = """schema = 1
name = "three-joints"
[arm]
model = "dh"
{}
[tool]
point_m = [0.031, -0.012, 0.052]
[noise]
position_m = 1e-5
"""


POSES = """x_m,y_m,z_m,rx_rad,ry_rad,rz_rad
0.4,0.1,0.3,3.1,0.0,0.0
0.35,-0.2,0.4,2.9,0.2,0.1
"""
WELD = """DEF weld()
$BASE = {X 0.0, Y 0.0, Z 0.0, A 0.0, B 0.0, C 0.0}
PTP {A1 0, A2 -90, A3 90, A4 0, A5 90, A6 0}
LIN {X 400.0, Y 100.0, Z 300.0, A 180.0, B 0.0, C 180.0}
END
"""
URSCRIPT = """def weld():
  set_tcp(p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
  above = p[0.4, 0.1, 0.3, 3.1, 0.0, 0.0]
  movej([0.0, -1.57, 1.57, 0.0, 1.57, 0.0], a=1.4, v=1.05)
  movel(above, a=1.2, v=0.25)
  movel(p[0.35, -0.2, 0.4, 2.9, 0.2, 0.1], v=0.10)
end
"""
RAPID = """MODULE weld
  PERS tooldata torch := [TRUE,[[0.0,0.0,0.0],[1,0,0,0]],[1.0,[0,0,1.0],[1,0,0,0],0,0,0]];
  CONST robtarget p10 := [[400.0,100.0,300.0],[0.0,1.0,0.0,0.0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home := [[0.0,-90.0,90.0,0.0,90.0,0.0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home, v200, z10, torch;
    MoveL p10, v50, fine, torch\\WObj:=wobj0;
  ENDPROC
ENDMODULE
"""
FANUC = """/PROG  WELD
/MN
   1:J P[1] 100% FINE    ;
   2:L P[2] 50mm/sec FINE    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 1,
\tJ1 = 0.000 deg, J2 = -90.000 deg, J3 = 90.000 deg, J4 = 0.000 deg, J5 = 90.000 deg, J6 = 0.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX = 400.000 mm, Y = 100.000 mm, Z = 300.000 mm,
\tW = 180.000 deg, P = 0.000 deg, R = 0.000 deg
};
/END
"""
MJCF = """<mujoco model="two">
<compiler angle="radian" autolimits="true"/>
<worldbody><body name="base" pos="0 0 0.3"><body name="upper">
<joint name="a" axis="0 0 1" range="-3 3"/><geom type="sphere" size="0.05" mass="2" pos="0 0 0.1"/>
<body name="fore" pos="0.4 0 0" quat="0.7 0.7 0 0"><joint name="b" axis="0 1 0" pos="0.02 0 0" ref="0.1" range="-2 2"/>
<geom type="sphere" size="0.05" mass="1"/><site name="tip" pos="0.3 0 0.05" euler="0 0.5 0"/>
</body></body></body></worldbody></mujoco>
"""
URDF = """<robot name="two">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="tip"/><origin xyz="0.4 0 0" rpy="1.57 0 0"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>
"""
DH = """standard,a [mm],alpha [deg],d [mm],theta [deg]
1,0,90,300,0
2,400,0,0,0
3,300,0,0,0
"""


def write_inputs(folder: Path, run: Run) -> None:
    """All of them. `run` is calibeam's command line in this process: models and diagnoses are its own."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(3)
    q = rng.uniform(-2.0, 2.0, (20, len(LINKS)))
    _session(folder / "tracker", q, seen(q + np.array([0.0, 2e-4, 3e-4]), rng))
    _session(folder / "other", q, seen(q, rng))
    longer = rng.uniform(-2.0, 2.0, (32, len(LINKS)))
    _session(folder / "longer", longer, seen(longer + np.array([0.0, 2e-4, 3e-4]), rng))
    again = np.tile(q[:4], (3, 1))
    _session(folder / "cycled", again, seen(again, rng))
    cycles = "".join(f"[[block.pose]]\nq_rad = {one.tolist()}\nrepeat = {k}\n" for k, one in enumerate(q[:4], start=1))
    (folder / "cycles.toml").write_text(f'schema = 1\nrig = "three-joints"\n[[block]]\n{cycles}', encoding="utf-8")
    turned = np.tile([0.2, -0.9, 0.8], (20, 1))
    for row in range(20):
        turned[row, 1 + row // 10] += -1.2 + 2.4 * (row % 10) / 9.0
    _session(folder / "turned", turned, seen(turned, rng))
    family: Family
    for family, rows in (("dual-psd", 24), ("cones", 40), ("wire", 40)):
        write_case(conceal(Wanted(family, 7, samples=rows, places=3, arm="irb120")), folder / "case")
        (folder / "case" / "recording").rename(folder / family)
        shutil.rmtree(folder / "case")
    _parquet(folder / "tracker", folder / "columns")
    _guided(folder)
    _ur(folder)
    _of_laboratories(folder)
    _can_logs(folder)
    _streams(folder / "streams.mcap", folder / "rig.toml")
    _made_by_calibeam(folder, run)


def seen(q_rad: Floats, rng: np.random.Generator) -> Floats:
    """Positions (row, 3) of the target in a tracker's frame, by turning it back through every link."""
    point = np.tile(POINT_M, (len(q_rad), 1))
    for j, (a, alpha, d) in reversed(list(enumerate(LINKS))):
        point = Rotation.from_rotvec([alpha, 0, 0]).apply(point) + np.array([a, 0.0, d])
        point = Rotation.from_rotvec(q_rad[:, j, None] * [0, 0, 1]).apply(point)
    point = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1.0, 2.0, 0.5])
    return point + rng.normal(0.0, 1e-5, point.shape)


def _session(folder: Path, q_rad: Floats, position_m: Floats) -> None:
    folder.mkdir()
    joints = "".join(JOINT.format(*map(float, link)) for link in LINKS)
    (folder / "rig.toml").write_text(RIG.format(joints), encoding="utf-8")
    with (folder / "samples.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t_s", *(f"q{j + 1}_rad" for j in range(len(LINKS))), "x_m", "y_m", "z_m", "temp_arm_degC"])
        for k, row in enumerate(np.hstack([q_rad, position_m]).tolist()):
            writer.writerow([float(k), *row, 20.0 + 0.01 * k])


def _parquet(source: Path, folder: Path) -> None:
    folder.mkdir()
    shutil.copy(source / "rig.toml", folder)
    with (source / "samples.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    pq.write_table(pa.table({name: [float(row[name]) for row in rows] for name in rows[0]}), folder / "samples.parquet")


def _guided(folder: Path) -> None:
    """A verification of the measuring arm, and its model, which is the arm as drawn."""
    source = RIGS / "arm-cmm-reference.toml"
    rig, rng = load_rig(source), np.random.default_rng(1)
    arm = AssumedGuidedArm.of_rig(rig)

    def posture(point_m: tuple[float, ...]) -> Floats:
        return arm.postures(rng.uniform(arm.lower_rad, arm.upper_rad, (200, 6)), np.array(point_m))[0]

    rows = [(posture((0.5, 0.1, 0.2)), "1,,") for _ in range(10)]
    rows += [
        (posture((0.5, -0.3, 0.2)), ",1,a"),
        (posture((0.5, rig.bars[1].length_m - 0.3, 0.2)), ",1,b"),
    ]
    (folder / "guided").mkdir()
    shutil.copy(source, folder / "guided" / "rig.toml")
    header = "t_s," + ",".join(f"q{i}_rad" for i in range(1, 7)) + ",seat,bar,bar_end"
    lines = [f"{k},{','.join(map(repr, map(float, q)))},{what}" for k, (q, what) in enumerate(rows)]
    (folder / "guided" / "samples.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    _drawn_model(folder / "guided.json", source)


def _drawn_model(path: Path, rig_file: Path) -> None:
    """The model of an arm that is as drawn: all corrections are zero."""
    rig, text = load_rig(rig_file), rig_text(rig_file)
    names = [p.name for p in with_discs(arm_of(rig), rig).parameters] + ["tool.x", "tool.y", "tool.z"]
    identity = RigIdentity(rig.name, rig_sha256(text), text)
    model = ModelFile(
        1, "calibeam-model", "test", identity, rig.arm.model.value, "CONVERGED", "", 10, 1, 1, None, (), (), (),
        dict.fromkeys(names, 0.0), None, {}, None, None, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip
    write_model(path, model)


def _of_laboratories(folder: Path) -> None:
    """A table as others write it, as CSV, Parquet and workbook; and a ROS 2 bag of each storage."""
    rng = np.random.default_rng(5)
    headings = ["Time [s]", *(f"A{i} [deg]" for i in range(1, 4)), "X [mm]", "Y [mm]", "Z [mm]", "Remark"]
    q_deg, xyz_mm = rng.uniform(-90.0, 90.0, (12, 3)).round(4), rng.uniform(300.0, 900.0, (12, 3)).round(4)
    rows = [[float(k), *q, *xyz, "ok"] for k, (q, xyz) in enumerate(zip(q_deg.tolist(), xyz_mm.tolist(), strict=True))]
    with (folder / "lab.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([headings, *rows])
    numbers = {name: list(column) for name, column in zip(headings, zip(*rows, strict=True), strict=True)}
    pq.write_table(pa.table(numbers), folder / "lab.parquet")
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (headings, *rows):
        sheet.append(row)
    book.save(folder / "lab.xlsx")
    for suffix, storage in (("db3", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
        _bag(folder / f"bag-{suffix}", storage, np.radians(q_deg))


def _bag(path: Path, storage: StoragePlugin, q_rad: Floats) -> None:
    """Joint states, a tenth of a second apart."""
    store, kind = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState"
    header, stamp = (store.types[name] for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
    with Writer(path, version=9, storage_plugin=storage) as bag:
        topic = bag.add_connection("/joint_states", kind, typestore=store)
        for k, q in enumerate(q_rad):
            now, none = header(stamp(1_790_000_000, 100_000_000 * k % 10**9), "base"), np.empty(0)
            state = store.types[kind](now, ["a", "b", "c"], q, none, none)
            bag.write(topic, 1_790_000_000 * 10**9 + 10**8 * k, store.serialize_cdr(state, kind))


def _ur(folder: Path) -> None:
    """The shipped arm with encoders by DBC, error maps and, in eye.toml, a camera; no device is where it says."""
    names = ("ur5e-dual-psd.toml", "ur5e-dual-psd-camera.toml", "ur5e-tracker.toml")
    plain, eye, tracked = ((RIGS / name).read_text("utf-8") for name in names)
    tracked = tracked.replace("127.0.0.2", "127.0.0.9").replace('"127.0.0.1" ', '"127.0.0.9" ')
    (folder / "tracked.toml").write_text(tracked, encoding="utf-8")
    encoders = plain[plain.index("[devices.encoders]") : plain.index("[devices.robot]")]
    signals = ", ".join(f'"ENCODER{i}.Angle"' for i in range(1, 7))
    described = (
        '[devices.encoders]\ndriver = "can-dbc"\ninterface = "slcan"\nchannel = "away/can"\n'
        f'dbc = "encoders.dbc"\nsignals = [{signals}]\n\n'
    )
    for name, text in (("rig.toml", plain.replace(encoders, described)), ("eye.toml", eye)):
        text = text.replace("out/emulated/", "away/").replace("127.0.0.2", "127.0.0.9")
        text = text.replace('port = "away/psd"', 'port = "away/psd"\nerror_maps = ["psd1.json", ""]')
        text = text.replace("http://127.0.0.1:8071/image.jpg", "away.jpg").replace("out/camera/", "")
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(RIGS / "encoders-plain.dbc", folder / "encoders.dbc")
    shutil.copy(RIGS / "tasks" / "conveyor.toml", folder / "task.toml")
    shutil.copy(RIGS / "tasks" / "two-pins.toml", folder / "cell.toml")
    heads = ",".join(f"q{i}_deg" for i in range(1, 7))
    at = ("at pin", "before pin", "pin lifted", "in hole 1", "before hole 1", "touching hole 1", "upright in hole 1")
    rows = [f"{name},{4 * k},-90,90,-90,-90,{k}" for k, name in enumerate((*at, "in hole 2"))]
    (folder / "taught.csv").write_text("\n".join((f"at,{heads}", *rows, "")), encoding="utf-8")
    errors = (RIGS / "errors" / "arm-cmm.toml").read_text("utf-8").replace("heat.link5", "heat.link2")
    for narrower in FEW_ERRORS:
        errors = errors.replace(*narrower)
    (folder / "errors.toml").write_text(errors, encoding="utf-8")
    gain = (0.0, 0.01, 0.0, 0.0, 0.0)
    (folder / "psd1.json").write_text(ErrorMap(0.01, gain, gain, (1e-6,) * 5, (1e-6,) * 5, 0.9).text())
    (folder / "camera.json").write_text(json.dumps(_camera(), indent=1), encoding="utf-8")
    _drawn_model(folder / "arm.json", folder / "rig.toml")
    poses = "".join(
        f"[[block.pose]]\nq_rad = [0.3, -1.4, 1.6, -0.5, 0.5, {0.1 * k:.1f}]\napproach = [1, 1, 0, 0, -1, 1]\n"
        for k in range(4)
    )
    plan = f'schema = 1\nrig = "ur5e-dual-psd"\npurpose = ["a test"]\n[[block]]\nplacement = 1\nfirst_psd = 1\n{poses}'
    (folder / "plan.toml").write_text(plan, encoding="utf-8")
    series = "[[joint]]\nmiddle_rad = 0.1\nsine_rad = [0.2, -0.1]\ncosine_rad = [0.2, -0.05]\n"
    motion = f'schema = 1\nrig = "{load_rig(folder / "rig.toml").name}"\nlength_s = 9.0\nrepeats = 2\n'
    motion += series * load_rig(folder / "rig.toml").n_joints
    (folder / "motion.toml").write_text(motion, encoding="utf-8")
    spots = "\n".join(f"{x:.3f},{y:.3f}" for x in (-0.006, -0.002, 0.002, 0.006) for y in (-0.006, 0.0, 0.006))
    (folder / "poses.csv").write_text(POSES, encoding="utf-8")
    for suffix, program in {"src": WELD, "script": URSCRIPT, "mod": RAPID, "ls": FANUC}.items():
        (folder / f"weld.{suffix}").write_text(program, encoding="utf-8")
    (folder / "arm.urdf").write_text(URDF, encoding="utf-8")
    (folder / "arm.xml").write_text(MJCF, encoding="utf-8")
    (folder / "dh.csv").write_text(DH, encoding="utf-8")
    (folder / "points.csv").write_text(f"x_m,y_m\n{spots}\n", encoding="utf-8")
    fit = 'schema = 1\nmodel = "mdh"\nfree = ["joint*.zero"]\nhold = ["link3.*"]\nloss = "huber"\nseed = 1\n'
    (folder / "fit.toml").write_text(fit + '[priors]\n"link*.length" = 1e-3\n"link*.twist" = 1e-3\n', encoding="utf-8")


def _camera() -> dict[str, Any]:
    return {
        "schema": 1, "kind": "calibeam-camera", "rig": "ur5e-dual-psd-camera", "software": "test",
        "width_px": 960, "height_px": 720,
        "matrix_px": [[760.0, 0.0, 480.0], [0.0, 760.0, 360.0], [0.0, 0.0, 1.0]],
        "distortion": [0.0, 0.0, 0.0, 0.0, 0.0],
        "in_flange": {"origin_m": [0.045, 0.02, 0.055], "rotation_rad": [-1.57, 0.0, 0.0]},
        "views": 12, "reprojection_px": 0.2, "board_m": 1e-4, "board_rad": 1e-3,
    }  # fmt: skip


def _frames() -> list[can.Message]:
    """Frames of anybody's, and those of the encoders.dbc has them, in order of time."""
    rng = np.random.default_rng(4)
    angles = [
        can.Message(
            timestamp=1_790_000_000.2501 + 1e-3 * k,
            arbitration_id=257 + k % 6,
            is_extended_id=False,
            data=(1000 * k).to_bytes(4, "little") + bytes((k // 6, 0)),
            channel=0,
        )
        for k in range(30)
    ]
    others = [
        can.Message(
            timestamp=1_790_000_000.25 + 1e-3 * k,
            arbitration_id=int(rng.integers(0, 0x7FF)),
            is_extended_id=k % 3 == 0,
            data=rng.bytes(k % 9),
            channel=0,
        )
        for k in range(30)
    ]
    return sorted(angles + others, key=lambda message: message.timestamp)


def _can_logs(folder: Path) -> None:
    writers = {"log": can.CanutilsLogWriter, "asc": can.ASCWriter, "blf": can.BLFWriter, "csv": can.CSVWriter}
    for suffix, make in writers.items():
        with make(folder / f"bus.{suffix}") as writer:
            for message in _frames():
                writer.on_message_received(message)


class _Standing:
    """Host time that never passes."""

    def now_s(self) -> float:
        return 0.0


def _streams(path: Path, rig_file: Path) -> None:
    """Streams, CAN frames, samples and events of one short session, as a session writes them."""
    six, t, pose = (6,), np.arange(50) * 0.01, {"placement": 1, "first": 1, "index": 0, "again": 0}
    with RecordingWriter(path, rig_text=rig_text(rig_file), software="test", clock=_Standing()) as writer:
        for name, made in {
            "robot": (Channel("actual_q_rad", "rad", six), Channel("actual_qd_rad_s", "rad/s", six)),
            "encoders": (Channel("position_rad", "rad", six),),
            "spots": tuple(Channel(each, "m") for each in ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")),
        }.items():
            stream = writer.stream(name, made)
            values = {one.name: np.sin(t).reshape(-1, *[1] * len(one.shape)) * np.ones(one.shape) for one in made}
            stream.append(t, t, np.arange(len(t)), values)
            stream.gap(Gap(0.5, 1.0, 50, "cable pulled"))
        block = block_of([frame_of(m, m.timestamp - 1_790_000_000.0, sent=False) for m in _frames()], 8)
        frames = writer.stream("can", channels(8), viewer=())
        frames.append(block.host_s, block.device_s, np.arange(len(block.host_s)), block.values)
        for k in range(3):
            q = {f"q{i + 1}_rad": 0.1 * i + 0.05 * k for i in range(6)}
            writer.sample({"t_s": float(k), "placement": 1, "first_psd": 1, **q})
            writer.event(Event(float(k), "sample", {"pose": pose | {"index": k}}))


def _made_by_calibeam(folder: Path, run: Run) -> None:
    """What its own commands write: model, diagnosis, recording, results of a fleet. RuntimeError where they fail."""
    earlier, fleet = folder / "earlier", folder / "fleet"
    (folder / "long").mkdir()
    teach = ["task", "teach", f"{folder}/cell.toml", "--rig", f"{folder}/rig.toml", "--poses", f"{folder}/taught.csv"]
    for words in (
        ["identify", f"{folder}/tracker", "--out", f"{folder}/model.json"],
        ["diagnose", f"{folder}/tracker", "--out", f"{folder}/diagnosis.json"],
        ["report", f"{folder}/tracker", "--out", f"{folder}/report.html"],
        ["import", f"{folder}/tracker", "--out", f"{folder}/recording.mcap"],
        ["import", f"{folder}/longer", "--out", f"{folder}/long/recording.mcap"],
        [*teach, "--out", f"{folder}/taught.toml"],
        ["import", f"{folder}/turned", "--out", f"{folder}/turned.mcap"],
        ["import", f"{folder}/guided", "--out", f"{folder}/guided.mcap"],
        ["export", f"{folder}/streams.mcap", "--streams", "--out", f"{folder}/streamed"],
        ["export", f"{folder}/streams.mcap", "--streams", "--table", "parquet", "--out", f"{folder}/columned"],
    ):
        if code := run(words):
            raise RuntimeError(f"calibeam {' '.join(words)}: exit code {code}")
    _with_a_finding(folder / "diagnosis.json")
    _with_effects(folder)
    for name in ("model.json", "diagnosis.json"):
        earlier.mkdir(exist_ok=True)
        shutil.copy(folder / name, earlier)
    for name in ("diagnosis.html", "report.html"):  # made so that a fork finds figures and fonts loaded
        (folder / name).unlink()
    (folder / "begun").mkdir()
    shutil.copy(folder / "streams.mcap", folder / "begun" / "recording.mcap")
    shutil.copytree(folder / "tracker", folder / "fleet-of-one" / "tracker")
    fleet.mkdir()
    row = judge_recording(Task.of(find_recordings(folder / "fleet-of-one", fleet)[0], diagnose=False))
    write_rows(fleet / "fleet.parquet", [row])
    (fleet / "fleet.rows.jsonl").write_bytes(msgspec.json.encode(row) + b"\n")


def _with_effects(folder: Path) -> None:
    """physics.json: the model with two effects, one of them by a curve, and the session that they are stated about."""
    file = json.loads((folder / "model.json").read_bytes())
    with (folder / "tracker" / "samples.csv").open(encoding="utf-8", newline="") as table:
        rows = list(csv.DictReader(table))
    kept = ("t_s", *(f"q{i}_rad" for i in range(1, 4)))
    conditions = {name: [float(row[name]) for row in rows] for name in kept}
    size = {"value": 1e-4, "sigma": 1e-6, "unit": "rad"}
    disc = {"name": "joint2-eccentricity", "where": "joint2.angle", "physics": "encoder-eccentricity"}
    disc |= {"depends_on": "q2", "shape": "harmonic", "order": 1, "variant": "", "parameters": {"amplitude_rad": size}}
    disc |= {"coefficients": {"disc.c0": 1e-4, "disc.c1": 2e-4}, "inner": {}, "about": {}, "holds": "always"}
    disc |= {"range": {"q2": [min(conditions["q2_rad"]), max(conditions["q2_rad"])]}, "confidence": 0.9}
    unknown = disc | {"name": "joint3-unknown", "where": "joint3.angle", "physics": "unknown", "depends_on": "t"}
    unknown |= {"shape": "smooth", "order": None, "component": 2, "waves": 2, "holds": "session", "range": {}}
    unknown |= {"coefficients": {"u.c0": 1e-5, "u.c1": 1e-5}, "parameters": {}}
    unknown |= {"curve": {"driver": "t", "unit": "rad", "knots": [0.0], "values": [0.0], "sigma": [1e-6]}}
    file |= {"schema": 2, "effects": [disc, unknown], "needs": []}
    file["session"] = {"started_utc": "", "first_t_s": 0.0, "last_t_s": 99.0, "readings_sha256": "0" * 64}
    file["session"]["conditions"] = conditions
    (folder / "physics.json").write_text(json.dumps(file, indent=1), encoding="utf-8")


def _with_a_finding(path: Path) -> None:
    """So small a session shows none; the page of one reads more keys."""
    file = json.loads(path.read_bytes())
    name = {"where": "joint2.angle", "depends_on": "q2", "shape": "harmonic", "order": 1}
    rival = name | {"physics": "encoder-harmonic", "confidence": 0.1, "margin": 4.0}
    curve = {"driver": "q2", "unit": "rad", "values": [0.0, 1.0], "residual": [1e-4, 2e-4], "fitted": [1e-4, 2e-4]}
    size = {"amplitude_rad": {"value": 2e-4, "sigma": 1e-5}, "phase_rad": {"value": 0.4, "sigma": 0.03}}
    finding = name | {"physics": "encoder-eccentricity", "parameters": size, "share": 0.8, "confidence": 0.9}
    finding |= {"says": "a disc off its shaft", "rivals": [rival], "p": 1e-4, "bic_gain": 20.0, "held_out_gain": 5.0}
    file["findings"] = [finding | {"curve": curve}]
    path.write_text(json.dumps(file, indent=1), encoding="utf-8")
