"""Takes pictures of the WebXR scene's objects, a folder per material, for own references.

    PYTHONPATH=tests/support python tests/browser/webxr_frames.py pictures --views 6

The scene takes each picture as it does when a hand is at an object (`frameCamera`), from head
positions that come from a seed.
"""

from __future__ import annotations

import argparse
import base64
from pathlib import Path
from typing import Any

import numpy as np
from toolchains import missing
from webxr_scene import visiting

SEED = 101
NEAREST, FARTHEST = (-0.55, 1.15, 0.3), (0.55, 1.7, 0.85)  # m, where the head may be: x, y, z
LOOK = """async ({main}, [key, x, y, z]) => {
  const object = main.objects.find((one) => one.key === key);
  const frame = await main.frameCamera.frame(object, {x, y, z});
  const text = (bytes) => btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
  return frame && {...frame, image: text(frame.image), mask: text(frame.mask)};
}"""


def shoot(visit: Any, folder: Path, views: int) -> None:
    """Take a picture of every object from every place; objects that are hidden give none."""
    dice = np.random.default_rng(SEED)
    places = [dice.uniform(NEAREST, FARTHEST).tolist() for _ in range(views)]
    for key, truth in visit.truths().items():
        (folder / truth / "masks").mkdir(parents=True, exist_ok=True)
        for number, place in enumerate(places):
            if (frame := visit.modules.evaluate(LOOK, [key, *place])) is not None:
                name = f"{key.replace(' ', '_')}-{number}"
                image, mask = (base64.b64decode(frame[each]) for each in ("image", "mask"))
                (folder / truth / f"{name}.jpg").write_bytes(image)
                (folder / truth / "masks" / f"{name}.png").write_bytes(mask)


def main() -> None:
    """Open the scene and take the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--views", type=int, default=6, help="of each object (%(default)s)")
    arguments = parser.parse_args()
    if reason := missing("chromium", "three"):
        raise SystemExit(reason)
    with visiting() as visit:
        shoot(visit, arguments.folder, arguments.views)


if __name__ == "__main__":
    main()
