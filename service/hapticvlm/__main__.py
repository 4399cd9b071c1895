"""`python -m hapticvlm` is the `hapticvlm` command."""

import sys

if __name__ == "__main__":  # the service's child processes import this file and need no command
    from hapticvlm.commands.main import main

    sys.exit(main())
