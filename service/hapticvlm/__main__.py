"""Runs the `hapticvlm` command for `python -m hapticvlm`."""

try:  # Ctrl-C may come while even these are imported, because `signal` takes milliseconds
    import signal
    import sys
except KeyboardInterrupt:
    raise SystemExit(130) from None


LOST_S = 0.02  # until a lost Ctrl-C is sent again: the callback that lost it has returned by then


def run() -> int:
    """Run the command and return its exit code; Ctrl-C shows no traceback, however early it is."""
    try:
        sys.unraisablehook = _repeat_ctrl_c
        handler = signal.getsignal(signal.SIGINT)
        if handler is signal.default_int_handler:  # a background job of a shell ignores it: keep it
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        from hapticvlm.standard_streams import open_missing

        open_missing()
        from hapticvlm.commands.main import main

        signal.signal(signal.SIGINT, handler)
        return main()
    except KeyboardInterrupt:  # before SIGINT is at its default, or while options are parsed
        return 130  # a command that has begun reports it by itself


def _repeat_ctrl_c(lost: "sys.UnraisableHookArgs") -> None:
    """Send Ctrl-C again if Python lost it: its exception cannot leave a callback or a `__del__`.

    An import runs many such callbacks. A service that was stopped while it started would print a
    traceback, lose the signal, and run on.
    """
    if lost.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(lost)
        return
    import os
    from threading import Timer

    if os.name == "nt":  # `os.kill` ends a process there
        Timer(LOST_S, signal.raise_signal, [signal.SIGINT]).start()
    else:
        Timer(LOST_S, os.kill, [os.getpid(), signal.SIGINT]).start()


if __name__ == "__main__":  # the service's child processes import this file without running it
    try:
        sys.exit(run())
    except KeyboardInterrupt:
        sys.exit(130)
