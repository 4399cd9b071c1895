"""The room of one mesh and 20 materials that the engines' clients touch."""

# The materials' names in the order of their panels, each larger than the one before.
ROOM = {
    "Oak_Planks": "wood",
    "Brushed_Steel": "metal",
    "mat14": "fabric",  # its texture is T_Felt_D
    "Window_Glass": "glass",
    "Marble_White": "stone",
    "Red_Brick": "stone",
    "Black_Rubber": "rubber",
    "Leather_Brown": "leather",
    "Cardboard_Box": "paper",
    "Plastic_ABS": "plastic",
    "Wool_Carpet": "fabric",
    "Copper": "metal",
    "Paper_Sheet": "paper",
    "Ceramic_Tile": "ceramic",
    "Granite": "stone",
    "Pine": "wood",
    "Linen": "fabric",
    "Porcelain": "ceramic",
    "Suede": "leather",
    "Walnut": "wood",
}
