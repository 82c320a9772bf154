"""Reading a recording needs no port: fits run where no instrument can be reached."""

import subprocess
import sys

PROGRAM = """
import sys
import acquisition.recording.check_recording, acquisition.recording.mcap.read
print(sorted({"serial", "can", "canopen", "socket", "ssl", "asyncio", "drivers"} & set(sys.modules)))
"""


def test_reading_loads_no_library_of_ports() -> None:
    said = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60.0, check=True)
    assert said.stdout.strip() == "[]"
