"""`python -m hapticvlm` is the `hapticvlm` command."""

import sys

from hapticvlm.cli import main

if __name__ == "__main__":
    sys.exit(main())
