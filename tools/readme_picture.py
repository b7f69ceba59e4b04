"""The picture of the README from the report of `make demo`: python tools/readme_picture.py [out/demo]"""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

POSES = ("warrior", "tree")
HEIGHT = 720

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo")
target = Path(__file__).resolve().parents[1] / "docs" / "images" / "demo.png"
pictures = [Image.open(folder / f"perspective_{pose}.png").convert("RGB") for pose in POSES]
pictures = [picture.resize((round(picture.width * HEIGHT / picture.height), HEIGHT)) for picture in pictures]
sheet = Image.new("RGB", (sum(picture.width for picture in pictures), HEIGHT), "white")
for index, picture in enumerate(pictures):
    sheet.paste(picture, (sum(before.width for before in pictures[:index]), 0))
target.parent.mkdir(exist_ok=True)
sheet.save(target, optimize=True)
print(target, target.stat().st_size // 1024, "kB")
