"""Draw pictures of docs/ again: `python -m hapticvlm_lab.bench.pictures [NAME ...]`."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from hapticvlm_lab.bench.pictures.recipes import RECIPES, names

DOCS = Path(__file__).parents[4] / "docs"


def main() -> int:
    """Read the command line; draw each picture, and print the time it took and its size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(RECIPES)} (all)")
    try:
        wanted = names(parser.parse_args().names)
    except KeyError as error:
        parser.error(str(error.args[0]))
    for name in wanted:
        print(f"{name} ...", flush=True)
        started = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            RECIPES[name](Path(folder), DOCS / name)
        size = (DOCS / name).stat().st_size
        print(f"{name}: {size / 1e3:.0f} kB in {time.monotonic() - started:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
