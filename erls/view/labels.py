"""Text of a picture: title, numbers on the axes, colour bar, and names beside their points without overlap."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from erls.maths.so3 import Array
from erls.view.camera import Camera, Pixels, Size, Walls, round_number, text_unit

if TYPE_CHECKING:
    from PIL.Image import Image

Rectangle = tuple[float, float, float, float]  # left, top, right, bottom
_INK = "#20242a"
_PALE = "#6b727c"


@dataclass(frozen=True)
class Label:
    """A text beside a place of the picture; ``key`` names it from frame to frame."""

    key: str
    text: str
    place: tuple[float, float]
    colour: str = _INK
    bold: bool = False
    scale: float = 1.0


class Sheet:
    """A rendered picture on which text is written.

    Parameters
    ----------
    pixels : (height, width, 3) array
    """

    def __init__(self, pixels: Pixels) -> None:
        import PIL.Image
        import PIL.ImageDraw

        self.image: Image = PIL.Image.fromarray(pixels)
        self.size: Size = self.image.size
        self.em = text_unit(self.size)
        self._draw: Any = PIL.ImageDraw.Draw(self.image)
        half = pixels[::2, ::2]
        ink = np.minimum(np.minimum(half[:, :, 0], half[:, :, 1]), half[:, :, 2]) < 212  # darker than the grid
        self._ink = np.pad(ink.cumsum(0, dtype=np.int32).cumsum(1), ((1, 0), (1, 0)))
        self._taken: list[Rectangle] = []

    def write(
        self,
        x: float,
        y: float,
        text: str,
        anchor: str = "lm",
        scale: float = 1.0,
        colour: str = _INK,
        bold: bool = False,
    ) -> None:
        """Write text at a pixel; ``anchor`` as in Pillow."""
        font = _font(self.em * scale, bold)
        text = _fitting(text, font, self.size[0] - 2 * self.em)
        halo = max(round(self.em * scale / 7), 1)
        self._draw.text((x, y), text, font=font, fill=colour, anchor=anchor, stroke_width=halo, stroke_fill="white")
        self._taken.append(self._draw.textbbox((x, y), text, font=font, anchor=anchor))

    def heading(self, title: str, caption: str) -> None:
        """Title and caption at the top left."""
        self.write(1.6 * self.em, 2.2 * self.em, title, scale=1.7, bold=True)
        self.write(1.6 * self.em, 4.1 * self.em, caption, scale=1.05, colour=_PALE)

    def axes(self, walls: Walls) -> None:
        """Numbers and titles on the edges of the measured box."""
        camera = walls.camera
        for tick in walls.ticks():
            out = walls.outward(tick.axis)
            scale = 1.0 if tick.title else 0.9
            left, top, right, bottom = self._extent(tick.text, scale)
            half = (abs(out[0]) * (right - left) + abs(out[1]) * (bottom - top)) / 2
            x, y = camera.project(tick.place) + out * (half + (2.9 if tick.title else 0.7) * self.em)
            if self._free((x + left, y + top, x + right, y + bottom)):
                self.write(x, y, tick.text, "mm", scale, _INK if tick.title else _PALE)

    def triad(self, camera: Camera, corner: tuple[float, float], gravity: Array | None) -> None:
        """Letters at the arrows of the axes triad, and at that of gravity, which starts at ``gravity``."""
        for axis, colour in enumerate(("#c62828", "#2e7d32", "#1565c0")):
            tip = camera.lift(*corner) + 3.9 * self.em * camera.pixel * np.eye(3)[axis]
            x, y = camera.project(tip)
            self.write(x, y, "xyz"[axis], "mm", 1.0, colour, bold=True)
        if gravity is not None:
            x, y = camera.project(gravity)
            self.write(x + 0.7 * self.em, y + 0.9 * self.em, "g", "lm", 1.0, "#222222", bold=True)

    def colour_bar(self, colours: Any, largest: float, name: str, unit: str) -> None:
        """Scale of what colours say, at the right."""
        import PIL.Image

        width, height = round(1.1 * self.em), round(self.size[1] * 0.42)
        left, top = self.size[0] - round(6.4 * self.em), round((self.size[1] - height) / 2)
        strip = (255 * colours(np.linspace(1, 0, height))[:, None, :3]).astype(np.uint8)
        self.image.paste(PIL.Image.fromarray(np.repeat(strip, width, axis=1)), (left, top))
        self._draw.rectangle((left, top, left + width, top + height), outline="#555555")
        self._taken.append((left - self.em, top, left + width, top + height))
        self.write(left + width / 2, top - 2.9 * self.em, name, "mm", 1.0)
        self.write(left + width / 2, top - 1.5 * self.em, f"[{unit}]", "mm", 1.0)
        step = round_number(max(largest, 1e-300) / 6)
        for value in np.arange(0, int(largest / step) + 1) * step:
            y = top + height * (1 - value / largest)
            self._draw.line((left + width, y, left + width + 0.35 * self.em, y), fill="#555555")
            self.write(left + width + 0.6 * self.em, y, f"{value:.6g}", "lm", 0.9, _PALE)
        self.write(left + width / 2, top + height + 1.2 * self.em, f"max {largest:.3g}", "mm", 0.9)

    def _extent(self, text: str, scale: float, bold: bool = False) -> Rectangle:
        """Rectangle of a text centred on the origin."""
        extent: Rectangle = self._draw.textbbox((0, 0), text, font=_font(self.em * scale, bold), anchor="mm")
        return extent

    def _free(self, box: Rectangle) -> bool:
        """Whether a rectangle lies on the picture and no text is there yet."""
        pad = 0.2 * self.em
        left, top, right, bottom = box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad
        within = left >= 0 and top >= 0 and right < self.size[0] and bottom < self.size[1]
        return within and not any(left < b[2] and b[0] < right and top < b[3] and b[1] < bottom for b in self._taken)

    def place(self, labels: Sequence[Label], before: dict[str, int] | None = None) -> dict[str, int]:
        """Write labels beside their places, where they cover least; those without any room are left out.

        Parameters
        ----------
        labels : sequence of Label
            The important ones first.
        before : dict, optional
            What the last frame of a film returned, so that labels stay at their side.
        """
        sides: dict[str, int] = {}
        for label in labels:
            left, top, right, bottom = self._extent(label.text, label.scale, label.bold)
            wide, high = right - left, bottom - top
            best: tuple[float, int] | None = None
            for side, (dx, dy) in enumerate(_SIDES):
                x = label.place[0] + dx * (self.em + wide / 2)
                y = label.place[1] + dy * (self.em + high / 2)
                cost = self._cost((x - wide / 2, y - high / 2, x + wide / 2, y + high / 2))
                cost += 0.004 * side - (0.15 if before is not None and before.get(label.key) == side else 0.0)
                if best is None or cost < best[0]:
                    best = (cost, side)
            if best is None or best[0] >= 1.0:
                continue
            sides[label.key] = best[1]
            dx, dy = _SIDES[best[1]]
            x, y = label.place[0] + dx * (self.em + wide / 2), label.place[1] + dy * (self.em + high / 2)
            self.write(x, y, label.text, "mm", label.scale, label.colour, label.bold)
        return sides

    def _cost(self, box: Rectangle) -> float:
        """Share of a rectangle that covers ink; 1 and more where it must not be."""
        if not self._free(box):
            return 2.0
        x0, x1, y0, y1 = (round(n / 2) for n in (box[0], box[2], box[1], box[3]))
        ink = self._ink[y1, x1] - self._ink[y0, x1] - self._ink[y1, x0] + self._ink[y0, x0]
        return min(float(ink) / max((x1 - x0) * (y1 - y0), 1), 0.9)


# beside the place, above, below, at its corners; then the same further away
_NEAR = [(x, y) for y in (-0.5, 0.5, 0) for x in (1, -1)] + [(0, -1), (0, 1), (1, -1), (1, 1), (-1, -1), (-1, 1)]
_SIDES = [(f * x, f * y) for f in (1.0, 1.8) for x, y in _NEAR]


@functools.cache
def _font(size: float, bold: bool) -> Any:
    """The typeface that comes with matplotlib: it knows Greek and most of Europe."""
    import matplotlib
    from PIL import ImageFont

    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return ImageFont.truetype(str(folder / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")), round(size))


def _fitting(text: str, font: Any, width: float) -> str:
    """A text on one line, cut to a width."""
    text = " ".join(text.split())
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "…") > width:
        text = text[:-1]
    return text + "…"
