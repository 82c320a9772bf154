"""Runs in an environment of its own: pylablib's client, unmodified, asks a KPA101 at HOST PORT; one JSON object out.

pylablib is GPL-3 and is not part of this program: this file is started as a process by test_third_party.py.
"""

import json
import sys
import time
import warnings

warnings.simplefilter("ignore")  # it says that it cannot cycle RTS on a network port

from pylablib.devices.Thorlabs import KinesisQuadDetector  # noqa: E402

host, port = sys.argv[1], int(sys.argv[2])
unit = KinesisQuadDetector((host, port))
try:
    info = unit.get_device_info()
    began_s = time.monotonic()
    readings = [unit.get_readings() for _ in range(50)]
    elapsed_s = time.monotonic() - began_s
    answers = {
        "info": {"serial_no": info.serial_no, "model_no": info.model_no, "fw_ver": info.fw_ver},
        "readings": readings[-1]._asdict(),
        "rate_hz": 50 / elapsed_s,
        "mode": unit.get_operation_mode(),
        "open": unit.set_operation_mode("open_loop"),
        "output": unit.set_manual_output(1.5, -2.5)._asdict(),
        "pid": unit.set_pid_parameters(p=0.25)._asdict(),
        "parameters": unit.get_output_parameters()._asdict(),
        "monitor": unit.set_operation_mode("monitor"),
    }
finally:
    unit.close()
print(json.dumps(answers))
