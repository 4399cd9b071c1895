"""Opens the null device in place of standard streams that the program was started without.

A service manager, a shell (`2>&-`) or `pythonw` may start a program whose stdin, stdout or stderr
is closed. Python then sets the stream to None, so `isatty`, `flush` and `fileno` of it fail. Worse,
the system gives descriptors 0 to 2 to the next files and sockets that are opened, and a log that is
written to descriptor 2 ends up in one of them. With the null device there, neither can happen, here
or in child processes.
"""

from __future__ import annotations

import os
import sys

# In the environment of a service: it ends when its input does, that is, when its owner has ended.
ENDS_WITH_INPUT = "HAPTICVLM_ENDS_WITH_INPUT"


def open_missing() -> None:
    """Open every standard stream that is closed; call it before any other file is opened."""
    for descriptor in (0, 1, 2):
        if not _is_open(descriptor):
            null = os.open(os.devnull, os.O_RDWR)
            if null == descriptor:
                os.set_inheritable(null, True)
            else:
                os.dup2(null, descriptor)
                os.close(null)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(null, mode, encoding="utf-8"))


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True
