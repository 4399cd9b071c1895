"""A graded capture of a few drawn objects, written in the captures format, for tests to look at."""

import io
import json
from pathlib import Path

import numpy as np
from PIL import Image

SIDE = 96  # px of a frame
VIEWS = 3
OBJECTS = {  # id: (truth, name)
    **{f"w{n}": ("wood", "Oak_Board") for n in range(3)},
    **{f"g{n}": ("glass", "Mesh_04") for n in range(3)},
    **{f"f{n}": ("fabric", "LinenCloth") for n in range(3)},
    **{f"m{n}": ("metal", "SteelPot") for n in range(3)},
    "s0": ("stone", "Rock"),
    "u0": ("unknown", "Sphere.021"),
}


def write_capture(folder: Path) -> Path:
    """Write VIEWS frames of each of OBJECTS with masks and regions; return the folder."""
    (folder / "frames").mkdir(parents=True)
    stated = [{"object_id": key, "name": name} for key, (_, name) in OBJECTS.items()]
    stated[-2]["material"] = "stone"
    lines = [{"t_s": 0.0, "type": "scene", "replace": True, "objects": stated}]
    for number, (key, (truth, _)) in enumerate(OBJECTS.items()):
        for view in range(VIEWS):
            at = 0.05 * (1 + number * VIEWS + view)
            name = f"frames/{key}_{view}"
            image, mask = drawn(truth, number, view)
            (folder / f"{name}.jpg").write_bytes(encoded(image, "JPEG"))
            (folder / f"{name}.png").write_bytes(encoded(mask, "PNG"))
            lines.append(frame_line(at, key, truth, name))
    text = "".join(json.dumps(line) + "\n" for line in lines)
    (folder / "capture.jsonl").write_text(text, encoding="utf-8")
    return folder


def frame_line(at: float, key: str, truth: str, name: str) -> dict[str, object]:
    """One frame of the capture; the region is the box of the drawn disc."""
    return {
        "t_s": at,
        "type": "frame",
        "captured_at": at,
        "format": "jpeg",
        "width": SIDE,
        "height": SIDE,
        "origin": "top",
        "object_id": key,
        "region": {"x": 0.1, "y": 0.1, "w": 0.8, "h": 0.8},
        "truth": truth,
        "file": f"{name}.jpg",
        "mask_file": f"{name}.png",
    }


def drawn(truth: str, number: int, view: int) -> tuple[np.ndarray, np.ndarray]:
    """A disc of something like the material before a plain wall: (S, S, 3) and (S, S) uint8."""
    rng = np.random.default_rng([number, view])
    y, x = np.mgrid[:SIDE, :SIDE]
    wall = np.full((SIDE, SIDE, 3), (150.0, 150.0, 140.0))
    inside = (x - SIDE / 2) ** 2 + (y - SIDE / 2) ** 2 < (SIDE * (0.3 + 0.03 * view)) ** 2
    image = np.where(inside[..., None], _surface(truth, number, x, y), wall)
    noisy = np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)
    return noisy, np.where(inside, 255, 0).astype(np.uint8)


def _surface(truth: str, number: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    wave = {
        "wood": 25 * np.sin(y / (5 + number)),
        "fabric": 40 * np.sign(np.sin(x * 1.3) * np.sin(y * 1.3)),
        "metal": 90 * np.exp(-((x - 40 - 3 * number) ** 2) / 60),
    }.get(truth, 0.0 * x)
    colour = {
        "wood": (150, 100, 55),
        "glass": (165, 175, 170),
        "fabric": (120, 40 + 5 * number, 60),
        "metal": (110, 112, 118),
        "stone": (120, 115, 108),
    }.get(truth, (240, 30, 240))
    return np.array(colour, float) + wave[..., None]  # type: ignore[no-any-return]


def encoded(pixels: np.ndarray, kind: str) -> bytes:
    """Encode pixels as JPEG or PNG."""
    store = io.BytesIO()
    Image.fromarray(pixels).save(store, kind, quality=92)
    return store.getvalue()
