"""The console command, also as `python -m calibeam`: it hears Ctrl-C before the libraries are loaded."""

import gc
import sys

from calibeam import check_folders
from calibeam.outcome import INTERRUPTS


def main() -> None:
    """Loads the command line, which takes up to a second, and runs it."""
    try:
        check_folders()
    except ImportError as another:
        sys.exit(f"error: {another}")
    INTERRUPTS.load()
    gc.set_threshold(50_000)  # objects between two searches for cycles: what the libraries load stays, and is a lot
    from calibeam.cli import main as run

    run()


if __name__ == "__main__":
    main()
