"""`python -m hapticvlm` is the `hapticvlm` command."""

import sys

from hapticvlm.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
