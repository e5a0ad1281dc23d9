"""Pictures and films as ``data:`` addresses, so that a page carries them inside."""

from __future__ import annotations

import base64
import dataclasses
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from PIL import Image

from studies.reporting.figures import to_png, to_svg

# A figure with very many marks is smaller, and drawn faster, as pixels.
_LARGEST_SVG = 400_000

# Inches: on a phone's 360 px, text of 10 points is then 12 px high.
_NARROW = 4.0

_SIGNATURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"GIF8": "image/gif"}


@dataclasses.dataclass(frozen=True)
class Media:
    """The content of a picture or film file.

    Attributes:
        data: The bytes of the file.
        kind: Its media type, such as ``"image/png"``.
        adaptive: It has a dark form of its own; all else gets a light ground to stand on.
    """

    data: bytes
    kind: str
    adaptive: bool = False

    @property
    def address(self) -> str:
        """A ``data:`` address that holds the content."""
        return f"data:{self.kind};base64,{base64.b64encode(self.data).decode('ascii')}"


def load_media(source: Figure | Media | bytes | str | Path) -> Media:
    """A figure, the bytes of a file, or its path, as ``Media``.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is none of PNG, GIF.
    """
    if isinstance(source, Media):
        return source
    if isinstance(source, Figure):
        svg = to_svg(source)
        if len(svg) <= _LARGEST_SVG:
            return Media(svg, "image/svg+xml", adaptive=True)
        return Media(to_png(source), "image/png")
    data = source if isinstance(source, bytes) else Path(source).read_bytes()
    for signature, kind in _SIGNATURES.items():
        if data.startswith(signature):
            return Media(data, kind)
    name = "the picture" if isinstance(source, bytes) else str(source)
    raise ValueError(f"{name} is none of PNG, GIF")


def narrowed(source: object) -> Media | None:
    """A matplotlib figure laid out for a phone, where its text keeps its size; else None.

    None also if the figure has axes side by side, or something would not fit any more.
    """
    if not isinstance(source, Figure):
        return None
    size = source.get_size_inches()
    grids = [axis.get_gridspec() for axis in source.axes]
    if size[0] <= _NARROW or any(grid is None or grid.ncols > 1 for grid in grids):
        return None
    try:
        source.set_size_inches(_NARROW, max(0.85 * size[1], min(size[1], 2.6)))
        picture = load_media(source)
        # Printed once, everything has its place.
        x0, y0, x1, y1 = source.get_tightbbox().extents
        inside = x0 > -0.05 and y0 > -0.05 and x1 < _NARROW + 0.05 and y1 < size[1] + 0.05
        return picture if inside else None
    finally:
        source.set_size_inches(size[0], size[1])


def still(media: Media) -> Media | None:
    """The middle frame of a GIF as PNG; None for anything else."""
    if media.kind != "image/gif":
        return None
    with Image.open(io.BytesIO(media.data)) as film:
        film.seek(getattr(film, "n_frames", 1) // 2)
        png = io.BytesIO()
        film.convert("RGB").save(png, "PNG", optimize=True)
    return Media(png.getvalue(), "image/png")


def encode_gif(frames: Sequence[ArrayLike], seconds_per_frame: float) -> bytes:
    """Frames as a GIF that repeats for ever.

    Args:
        frames: RGB pictures of one size, each of shape (height, width, 3), 0 to 255.
        seconds_per_frame: GIF counts in 0.01 s; browsers slow anything below 0.02 s down.

    Raises:
        ValueError: There is no frame.
    """
    if len(frames) == 0:
        raise ValueError("no frames to make an animation of")
    images = [Image.fromarray(np.asarray(frame).astype(np.uint8)).quantize(64) for frame in frames]
    gif = io.BytesIO()
    images[0].save(
        gif,
        "GIF",
        save_all=True,
        append_images=images[1:],
        duration=max(20, round(1000 * seconds_per_frame / 10) * 10),
        loop=0,
        optimize=True,
    )
    return gif.getvalue()
