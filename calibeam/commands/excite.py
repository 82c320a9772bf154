"""`calibeam excite`: a motion of all joints that shows their torques, before anything moves."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from acquisition.recording.motion_plan import MOTION_PLAN, write_motion_plan
from acquisition.recording.rig import load_rig
from calibeam.console import Console
from calibeam.overwriting import writes
from calibeam.printing.progress import progress_bar


@writes(out=MOTION_PLAN)
def excite_command(
    rig: Path,
    *,
    out: Path = Path("motion.toml"),
    length_s: Annotated[float, Parameter(validator=validators.Number(gte=2.0, lte=600.0))] = 20.0,
    repeats: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=100))] = 3,
    speed_share: Annotated[float, Parameter(validator=validators.Number(gt=0.0, lte=1.0))] = 0.5,
    torque_noise_nm: Annotated[float | None, Parameter(validator=validators.Number(gt=0.0, lte=1e4))] = None,
    seed: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 1,
) -> None:
    """Design a motion that shows the torques of all joints.

    Every joint follows a finite Fourier series that begins and ends at rest, within the limits of [motion] in the rig
    file. Prints how well friction, rotors, springs and a payload would be determined. Nothing moves.

    For example:

    ```
    calibeam excite rig.toml --out motion.toml; calibeam session rig.toml --motion motion.toml --out DIR
    ```

    Parameters
    ----------
    rig
        The rig file: arm, limits, home_rad, keep-out boxes; masses where they are known.
    out
        Where to write the motion: `calibeam session RIG --motion` runs it.
    length_s
        Of one repeat.
    repeats
        How often the motion is run, without a stop: repeats show the noise.
    speed_share
        Share of the rig's speed that no joint exceeds.
    torque_noise_nm
        Noise of a joint's torque at one moment. Default: 5 % of the torque that the stated masses take (rms), at
        least 1 % of that of the largest joint.
    seed
        Of everything that is drawn.

    """
    from calibeam.motion.exciting_motion import check_motion, clear_motion
    from calibeam.printing.excitation import print_excitation
    from calibrate.errors import DataError
    from calibrate.excitation import ExcitationWish, excite

    loaded, console = load_rig(rig), Console()
    if loaded.motion.home_rad is None:
        raise DataError(
            f"rig {loaded.name}: [motion] has no home_rad; give the joint readings of a pose clear of all obstacles, "
            "about which the motion is designed"
        )
    wish = ExcitationWish(length_s, repeats, speed_share, torque_noise_nm, seed)
    with progress_bar(Console(stderr=True)) as bar:
        task = bar.add_task("motions")
        made = excite(
            loaded, wish, clear_motion(loaded), lambda done, total: bar.update(task, completed=done, total=total)
        )
    check_motion(loaded, made.plan)
    write_motion_plan(out, made.plan)
    print_excitation(console, made, noise_given=torque_noise_nm is not None)
    console.print(
        f"motion: {out}; next: calibeam session {rig} --motion {out} --out DIR (the arm moves)",
        markup=False,
        highlight=False,
        soft_wrap=True,
    )
