"""The one place that decides which source teaches and which is held back.

Sources are split whole, never picture by picture: pictures of one source look alike. Held-back
sources are for measurements alone, never for training, gallery or calibration. Paths are relative
to the data folder (labels.csv, README.md).
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

from hapticvlm import materials

TILES = "ambientcg_tiles"
# Photographs that teach the head; LIVING gives its living things beside them.
TEACHING = (
    TILES,
    "trashnet",
    "clothing",
    "woodboards",
    "imagenet_small",
    "ccp_garments",
    "clothing_full",
    "coins",
    "glass_vessels_matsim",
)
TEXTURES = frozenset({TILES, "woodboards"})  # fill the picture
ON_BOARD = "trashnet"  # objects on a plain board
# Choose and calibrate; report on: no gradient sees either.
CHOICE = "choose_web"
REPORT = "report_web"
# Held back whole: photographs, the shapes and the textures with maps.
HELD_BACK = ("caltech101", "models", "pbr")
# Calibrate the confidence and nothing else: other people's renders, and scenery of no material.
CALIBRATION = ("pb_renders", "weather")
UNKNOWN = materials.UNKNOWN
# Pictures without labels; of the living things among them these teach "none of ours".
LIVING = "unlabelled_caltech101"
LIVING_TAUGHT = frozenset(
    """Leopards ant crab crocodile crocodile_head dolphin dragonfly emu gerenuk ibis llama mayfly
    okapi panda platypus rhino scorpion sea_horse strawberry tick wild_cat""".split()  # noqa: SIM905
)
KITS = "kits"  # game kits, a folder each, with labels.csv of their own
# Kits that are only reported on: a fifth of the objects (243 of 1,214; 178 of 819 with a clear
# material). Three authors made nearly all kits, so the figure has two parts. Kits of authors whose
# other kits teach: each of the three loses one or more whole kits, chosen by their lists of classes
# alone, so that all but leather occur; a palette of that author may be known. Authors of whom
# nothing teaches: hand-painted, measured maps, and a mix of many authors. Chosen before any of them
# was drawn or read by a network.
KITS_HELD_BACK = frozenset(
    """kaykit_prototype kenney_survival quaternius_dungeon_old quaternius_survival
    quaternius_village gdquest misc_pbr polypizza_mix""".split()  # noqa: SIM905
)
HDRI_HELD_BACK = frozenset({"forest_slope", "lebombo", "studio_small_03", "venice_sunset"})

_SAME = {"brick": "stone", "concrete": "stone"}
_ALSO_IN_PBR = frozenset(
    """Tiles036 Grass001 Metal007 Metal053 Metal055 Marble006 Marble009 Onyx003 Rock020 Rock053
    Rock058 Terrazzo019 Bark014 WoodFloor043""".split()  # noqa: SIM905
)
_TILES_HELD_BACK = 4  # one in so many tiles never teaches


def material_of(label: str) -> str:
    """Map a class of labels.csv to one of the material table, UNKNOWN if it has none."""
    name = _SAME.get(label, label)
    return name if name in materials.MATERIALS else materials.UNKNOWN


def is_tile_held_back(path: str) -> bool:
    """Return whether a tile of ambientcg_tiles is kept from training; `path` as in labels.csv.

    Variants of one asset (a final letter) go together, and assets that `pbr` also has are held
    back.
    """
    asset = path.rsplit("/", 1)[-1].split(".")[0].split("_")[0].rstrip("ABCDEFGHM")
    return asset in _ALSO_IN_PBR or crc32(asset.encode()) % _TILES_HELD_BACK == 0


def is_calibration_shard(stem: str) -> bool:
    """Return whether a shard of renders, by its name, calibrates instead of teaching."""
    return stem.endswith("9")


@dataclass(frozen=True, slots=True)
class Prop:
    """An object of a game kit: its path in the data folder, its material or UNKNOWN.

    UNKNOWN are those of several materials, of none in the table, and those a person would doubt.
    """

    path: str
    label: str

    @property
    def kit(self) -> str:
        """Name of the kit's folder."""
        return self.path.split("/")[1]


def props(data: Path) -> list[Prop]:
    """List the objects of all kits; KITS_HELD_BACK says which of them may not teach."""
    folder = data / KITS
    with (folder / "labels.csv").open(newline="", encoding="utf-8") as file:
        return [
            Prop(
                f"{KITS}/{row['path']}",
                UNKNOWN if "UNCLEAR" in row["note"] else material_of(row["class"]),
            )
            for row in csv.DictReader(file)
            if (folder / row["path"]).is_file()
        ]


def rows(data: Path, source: str) -> Iterator[dict[str, str]]:
    """Yield the rows of labels.csv of a source whose files exist."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["path"].startswith(f"{source}/") and (data / row["path"]).is_file():
                yield row


def labelled(data: Path, source: str) -> Iterator[tuple[Path, str]]:
    """Yield every picture of a source, with its class in labels.csv."""
    for row in rows(data, source):
        if row["path"].endswith(".jpg"):
            yield data / row["path"], row["class"]
