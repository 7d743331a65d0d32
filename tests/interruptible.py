"""Commands of Python processes that a Ctrl-C reaches, wherever the tests were started."""

from __future__ import annotations

import sys

# processes that a shell starts in the background ignore SIGINT, and so do their children
_WITH_SIGINT = (
    "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL);"
    "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
)


def interruptible(*arguments: object) -> list[str]:
    """Return the command of a Python process with SIGINT at its default; its id is the same."""
    return [sys.executable, "-ISc", _WITH_SIGINT, *map(str, arguments)]
