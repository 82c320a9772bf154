"""python -m simulators: one line of JSON in, {"rig": {}, "options": {}}; one line of JSON out when all listens."""

import json
import sys
from pathlib import Path

from simulators.errors import HostError, WorldError
from simulators.serve import ServeOptions, serve


def main() -> int:
    """Exit code 0 when asked to stop, 1 when the rig cannot be emulated."""
    request = json.loads(sys.stdin.readline())
    options = request["options"]
    if options.get("truth_path") is not None:
        options["truth_path"] = Path(options["truth_path"])
    try:
        serve(request["rig"], ServeOptions(**options), lambda where: print(json.dumps(where), flush=True))
    except (HostError, WorldError, ValueError, TypeError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
