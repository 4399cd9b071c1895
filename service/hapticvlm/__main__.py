"""Runs the `hapticvlm` command for `python -m hapticvlm`."""

try:  # Ctrl-C may come while even these are imported, because `signal` takes milliseconds
    import signal
    import sys
except KeyboardInterrupt:
    raise SystemExit(130) from None


def run() -> int:
    """Run the command and return its exit code; Ctrl-C shows no traceback, however early it is."""
    try:
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


if __name__ == "__main__":  # the service's child processes import this file without running it
    try:
        sys.exit(run())
    except KeyboardInterrupt:
        sys.exit(130)
