"""A process that serves a rig with three small instruments in place of the real emulators; started by test_serve.py.

python served.py '{"truth_path": "...", ...}'      options of ServeOptions, and the rig's path under "rig"
"""

import json
import sys
import tomllib
import types
from pathlib import Path

from simulators.serve import ServeOptions, serve
from simulators.wire import Bench, SerialPort, TcpPort


class Shout:
    def handle(self, data: bytes) -> bytes:
        return data.upper()

    def due(self) -> bytes:
        return b""


def install(folder: str, build) -> None:
    sys.modules[f"simulators.{folder}.emulator"] = types.SimpleNamespace(build=build)


def main() -> None:
    options = json.loads(sys.argv[1])
    rig = tomllib.loads(Path(options.pop("rig")).read_text())
    number = options.pop("robot_port")
    install("psd_daq", lambda world, rig: Bench([], [SerialPort("psd", Shout(), rig["devices"]["psd"]["port"])]))
    install(
        "encoders",
        lambda world, rig: Bench(
            [],
            [SerialPort("can", Shout(), rig["devices"]["encoders"]["channel"])],
            {"encoders.count": lambda: world.n_joints},
        ),
    )
    install("ur", lambda world, rig, host: Bench([], [TcpPort("rtde", host, number, Shout)]))
    if options.get("truth_path"):
        options["truth_path"] = Path(options["truth_path"])
    serve(rig, ServeOptions(**options), lambda where: print(json.dumps(where), flush=True))


if __name__ == "__main__":
    main()
