"""The symbolic link by which a rig file names a pseudo-terminal, whose own name changes with every start."""

import os
from pathlib import Path

from simulators.host.errors import HostError


def check_link(port_name: str, link: Path) -> None:
    """HostError when something stands at `link` that must not be replaced; call before any pseudo-terminal is opened.

    A left-over link of an emulator that was killed points to a terminal that is no more and may go. One whose target
    exists may be a real device or belong to an emulator that still runs.
    """
    if link.is_symlink():
        if link.exists():
            raise HostError(
                f"{port_name}: {link} already leads to {os.readlink(link)}; stop the emulator that uses it, "
                "or delete the link, or emulate without links"
            )
    elif link.exists():
        raise HostError(
            f"{port_name}: {link} exists and is no link of an emulator; name another port in the rig file, "
            "or emulate without links"
        )


def make_link(port_name: str, link: Path, target: str) -> None:
    """Makes `link` point to the terminal `target`, with its folder. HostError when the file system refuses."""
    try:
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    except OSError as error:
        raise HostError(
            f"{port_name}: cannot make the link {link}: {error.strerror}; name another port in the rig file, "
            "or emulate without links"
        ) from error


def remove_link(link: Path, target: str) -> None:
    """Removes `link` if it is still ours; a later emulator may have put its own there."""
    try:
        if os.readlink(link) == target:
            link.unlink()
    except OSError:
        return  # somebody else has removed or replaced it: nothing of ours is left
