"""From data to the shipped encoder: `python -m hapticvlm_lab.training --data D --work W`.

Draws rooms and game kits, describes every teaching picture by the network, fits the head, chooses
its scale on pictures that taught nothing, and writes the encoder's folder. Then it fits the layers
of flat pictures and of texture maps and adds them to the gallery. What was drawn into W is not
drawn again. `--only flat` and `--only texture` add one layer to an encoder that stays as it is;
`--only held-back` draws the kits that only report into W, for `chart whole --kits W`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hapticvlm.vision.encoders.encoder import DEFAULT, SHIPPED
from hapticvlm_lab.training import flat_layer, kits, making, sources, texture_layer
from hapticvlm_lab.training.rooms import RoomsError, shards

ROOM_SHARDS = 40
PARTS = {"encoder": making.make, "flat": flat_layer.add_to, "texture": texture_layer.add_to}
HELD_BACK = "held-back"


def main() -> int:
    """Read the command line and build an encoder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--work", type=Path, required=True, help="folder for what is made")
    parser.add_argument("--out", type=Path, default=SHIPPED / DEFAULT, help="folder to write to")
    parser.add_argument("--only", choices=(*PARTS, HELD_BACK), help="make this part alone")
    chosen = parser.parse_args()
    data, work = chosen.data, chosen.work
    try:
        if chosen.only == HELD_BACK:
            kits.draw(data, work, kits.kits(data, held_back=True))
            return 0
        if chosen.only != "texture":
            shards.draw(data, work / "rooms", range(ROOM_SHARDS))
            kits.draw(data, work / sources.KITS, kits.kits(data, held_back=False))
    except RoomsError as error:
        sys.stderr.write(f"rooms: {error}\n")
        return 2
    for part in [chosen.only] if chosen.only else PARTS:
        sys.stderr.write(PARTS[part](data, work, chosen.out) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
