"""`python -m hapticvlm` is the `hapticvlm` command."""

try:  # Ctrl-C may come while even these are imported: `signal` takes milliseconds
    import signal
    import sys
except KeyboardInterrupt:
    raise SystemExit(130) from None


def run() -> int:
    """Run the command. Ctrl-C ends it without a traceback from its first import on."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:  # a shell's background job ignores it, and may
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from hapticvlm.commands.main import main

    signal.signal(signal.SIGINT, handler)
    try:
        return main()
    except KeyboardInterrupt:  # while the options are read; the command itself says that it stopped
        return 130


if __name__ == "__main__":  # the service's child processes import this file and need no command
    sys.exit(run())
