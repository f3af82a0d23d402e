"""Run a command as this very process, bound to the life of the one that started it (Linux).

    python -I -S bound.py PARENT_PID COMMAND [ARGUMENT...]

When the parent ends for whatever reason, `kill -9` included, the kernel sends the command SIGTERM.
"""

import ctypes
import os
import signal
import sys
from collections.abc import Sequence

PR_SET_PDEATHSIG = 1  # of <sys/prctl.h>


def main(arguments: Sequence[str]) -> int:
    """Become the command; returns only if the parent has ended meanwhile."""
    parent, *command = arguments
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() == int(parent):
        os.execv(command[0], command)
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
