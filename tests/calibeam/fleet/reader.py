"""Stands in for calibeam.fleet.worker: the same lines in and out."""

import hashlib
import json
import os
import signal
import sys

print("ready", flush=True)
for line in sys.stdin:
    task = json.loads(line)
    path = task["path"]
    name = os.path.basename(path)
    if "exits" in name:
        print("about to go", file=sys.stderr, flush=True)
        os._exit(7)
    if "killed" in name:
        os.kill(os.getpid(), signal.SIGKILL)
    if "hangs" in name:
        signal.pause()
    if "babbles" in name:
        print("no row at all", flush=True)
        continue
    if "worker" in name and not os.path.exists(path + ".seen"):
        open(path + ".seen", "x").close()
        os.kill(os.getppid(), signal.SIGKILL)
        sys.exit()
    with open(path, "rb") as file:
        sha256 = hashlib.sha256(file.read()).hexdigest()
    row = {key: task[key] for key in ("path", "name", "size_bytes", "modified_ns")}
    row |= {"sha256": sha256, "software": sys.argv[1], "diagnosed": task["diagnose"], "rig": f"rig {os.getpid()}"}
    outcome = "failed" if "broken" in name else "identified"
    print(json.dumps(row | {"outcome": outcome, "error": "broken" * (outcome == "failed")}), flush=True)
