"""Runs the `hapticvlm` command for `python -m hapticvlm`."""

try:  # Ctrl-C may come while even these are imported, because `signal` takes milliseconds
    import signal
    import sys
except KeyboardInterrupt:
    raise SystemExit(130) from None


def run() -> int:
    """Run the command and return its exit code; from here on Ctrl-C shows no traceback."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:  # a background job of a shell ignores SIGINT: keep it
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from hapticvlm.standard_streams import open_missing

    open_missing()
    from hapticvlm.commands.main import main

    signal.signal(signal.SIGINT, handler)
    try:
        return main()
    except KeyboardInterrupt:  # while options are parsed; later the command reports it by itself
        return 130


if __name__ == "__main__":  # the service's child processes import this file without running it
    sys.exit(run())
