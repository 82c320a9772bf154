"""`calibeam replay`: a recording's motion once more, in a simulation with the geometry and the physics of a model."""

import json as as_json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from acquisition.recording import read
from calibeam.outcome import taken_back
from calibeam.results.identification import naming_source
from calibeam.simulation.physics import names_of
from calibeam.simulation.replayed_recording import over_noise, replay, write_replayed
from calibrate.model.model_file import read_model
from calibrate.quantities import angle, length


def replay_command(
    recording: Path,
    *,
    model: Path,
    out: Path = Path("simulated.mcap"),
    without: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    seed: int = 0,
    noise: bool = True,
    noise_found: Annotated[bool, Parameter(negative=())] = False,
    json: bool = False,
) -> None:
    """Move a simulated rig through a recording's motion, with a model's physics.

    The simulated rig has the geometry of the model and a mechanism for each of its effects (docs/simulation.md). It
    stands where the recorded one stood, at the same temperatures, with the same payload; what its instruments read is
    written as a recording of its own, which compare, identify and diagnose take.

    For example:

    ```
    calibeam replay site.mcap --model model.json --out simulated.mcap
    calibeam replay site.mcap --model model.json --without joint2-compliance --out stiff.mcap
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv.
    model
        The model.json of an identification or of a diagnosis.
    out
        The recording to make.
    without
        Name of an effect of the model to leave out; may be given several times.
    seed
        Of the noise.
    noise
        Draw noise as the recording's rig states it, or as the model found it where the rig states none.
    noise_found
        Draw the noise that the model found, instead of what the rig states.
    json
        Print what was done as one line of JSON.

    """
    known = read_model(model)
    with naming_source(recording):
        source = read(recording)
        found = replay(source, known, without=without, seed=seed, noisy=noise, noise_found=noise_found)
    about = {"replayed": recording.name, "model": model.name, "seed": str(seed), "noise": "drawn" if noise else "none"}
    with taken_back(out):
        write_replayed(out, found, source, about | ({"without": ", ".join(without)} if without else {}))
    apart = over_noise(found, source.samples)
    if json:
        sizes = {what: {"rms": rms, "noise": drawn} for what, (rms, drawn) in apart.items()}
        effects = [name for name, _ in found.physics.named]
        print(as_json.dumps({"effects": effects, "notes": found.notes, "measured_less_simulated": sizes}))
        return
    acting = [f"{name} ({made.defect.KIND})" for name, made in found.physics.named]
    print("physics: " + (", ".join(acting) if acting else "none" + ("" if names_of(known) else "; the model has none")))
    for note in found.notes:
        print(note)
    for what, (rms, drawn) in apart.items():
        says = angle if what.endswith("orientations") else length
        share = f", {rms / drawn:.2f} of the noise that was drawn ({says(drawn)})" if drawn > 0.0 else ""
        print(f"{what}: measured less simulated {says(rms)} rms{share}")
    if noise and found.noise.found:
        print(f"noise of {', '.join(found.noise.found)}: as the model found it")
    if noise and found.noise.silent:
        print(f"noise of {', '.join(found.noise.silent)}: none, for neither the rig nor the model states it")
    print(f"simulated: {out}")
