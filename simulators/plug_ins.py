"""Emulators that installed packages bring with their drivers: entry points of the group calibeam.devices.

Such an entry point is an object with `emulator`, "module:function", or an empty text where there is none. The function
is called with the world and the settings of the rig file, and gives a bench (simulators/wire.py).
"""

import importlib
import sys
from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Any

from simulators.host.errors import HostError
from simulators.wire import Bench

GROUP = "calibeam.devices"


def plug_in_bench(world: Any, other: Mapping[str, Any]) -> Bench | None:
    """The bench of one [[devices.other]]; None, and said on standard error, where its package emulates nothing.

    HostError naming the package where it cannot be loaded, and where no package has this driver.
    """
    driver = str(other.get("driver"))
    found = next(iter(entry_points(group=GROUP, name=driver)), None)
    if found is None:
        raise HostError(f"{other.get('name')}: no installed package brings the driver '{driver}'; install it")
    package = "?" if found.dist is None else f"{found.dist.name} {found.dist.version}"
    try:
        where = str(found.load().emulator)
        if not where:
            print(f"{other.get('name')}: the package {package} brings no emulator; left out", file=sys.stderr)
            return None
        module, _, function = where.partition(":")
        bench = getattr(importlib.import_module(module), function)(world, dict(other.get("settings", {})))
    except Exception as why:  # whatever a stranger's module raises
        raise HostError(
            f"{other.get('name')}: the emulator of the package {package} cannot be made: {type(why).__name__}: {why}"
        ) from why
    if not isinstance(bench, Bench) or not bench.ports:
        raise HostError(f"{other.get('name')}: the package {package} gives no bench with a port")
    return bench
