"""From data to the shipped encoder: `python -m hapticvlm_lab.training --data D --work W`.

Draws rooms, describes every teaching picture by the network, fits the head, chooses its scale on
pictures that taught nothing, and writes the encoder's folder. Files that exist in W are not
computed again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hapticvlm.vision.encoders.encoder import DEFAULT, SHIPPED
from hapticvlm_lab.training.making import make
from hapticvlm_lab.training.rooms import __main__ as rooms
from hapticvlm_lab.training.rooms.page import RoomsError

ROOM_SHARDS = 40


def main() -> int:
    """Read the command line and build an encoder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--work", type=Path, required=True, help="folder for what is made")
    parser.add_argument("--out", type=Path, default=SHIPPED / DEFAULT, help="folder to write to")
    chosen = parser.parse_args()
    try:
        rooms.draw(chosen.data, chosen.work / "rooms", range(ROOM_SHARDS))
    except RoomsError as error:
        sys.stderr.write(f"rooms: {error}\n")
        return 2
    sys.stderr.write(make(chosen.data, chosen.work, chosen.out) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
