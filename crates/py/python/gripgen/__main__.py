"""The command line: `gripgen ...` or `python -m gripgen ...`."""

import signal
import sys

from . import _core


def main() -> int:
    """Runs the command line and returns its exit code."""
    if sys.argv[1:2] == ["import"]:
        from .importing import run

        return run(sys.argv[2:])
    # The command line has a handler of its own for Ctrl-C; Python's would only act when it is done.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _core.run_cli(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
