"""A figure as SVG: in a file, or as an address inside a page."""

import base64
import io
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from wirebayes.io.run_folder import write_bytes
from wirebayes.processes.copies import in_copies

MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}  # of pictures, by the ending of the file
_DPI = 120  # of layers drawn as images
_DENSE = 1500  # points from which on an image takes less room than a path


def embedded(path: Path) -> str:
    """A picture file as a data address."""
    return _address(path.read_bytes(), path.suffix)


def drawn(figure: Figure) -> str:
    """A figure as a data address."""
    return _address(svg(figure), ".svg")


def drawn_together(figures: Sequence[Callable[[], Figure]]) -> list[str]:
    """Figures as data addresses, drawn on all cores.

    Parameters
    ----------
    figures : sequence of functions without arguments
        Each makes one.
    """

    def drawing(figure: Callable[[], Figure]) -> Callable[[], str]:
        return lambda: drawn(figure())

    return in_copies([drawing(figure) for figure in figures])


def _address(content: bytes, suffix: str) -> str:
    kind = MEDIA_TYPES[suffix]
    if suffix == ".svg":  # text in a data address is smaller than base64 of it
        return f"data:{kind},{quote(content, safe=_READ_AS_THEY_ARE)}"
    encoded = base64.b64encode(content).decode("ascii")
    return f"data:{kind};base64,{encoded}"


_READ_AS_THEY_ARE = " !$'()*+,-./:;=?@[]^_`{|}~"


def svg(figure: Figure) -> bytes:
    """A figure as SVG, the same bytes every time: letters as text, dense layers as images, no more digits than show."""
    _rasterize_dense(figure)
    stream = io.BytesIO()
    style: Any = {"svg.hashsalt": "wirebayes", "svg.fonttype": "none"}
    no_metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with matplotlib.rc_context(style):
        _lay_out(figure)
        figure.savefig(stream, format="svg", dpi=_DPI, metadata=no_metadata)
    text = stream.getvalue().decode("utf-8")
    begins = text.index("<svg")
    text = text[begins:].replace("<svg", f'<svg font-family="{_FONTS}"', 1)
    for pattern, instead in _SHORTER:
        text = pattern.sub(instead, text)
    text = _COORDINATES.sub(_shorter_path, text)
    return text.encode("utf-8")


def _rasterize_dense(figure: Figure) -> None:
    """Draw lines and clouds of very many points as images."""
    for axes in figure.axes:
        for line in axes.lines:
            if np.size(line.get_xdata(orig=False)) > _DENSE:
                line.set_rasterized(True)
        for cloud in axes.collections:
            if isinstance(cloud, PathCollection) and len(np.asarray(cloud.get_offsets())) > _DENSE:
                cloud.set_rasterized(True)


def _shorter_path(path: re.Match[str]) -> str:
    rounded = _LONG.sub(_tenth, path[0])
    return rounded.replace(" L ", " ")


def _lay_out(figure: Figure) -> None:
    """Place the axes for SVG, once: `savefig` would draw the whole figure to place them, and then draw it again."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    FigureCanvasSVG(figure)  # letters are measured as this one draws them
    dpi = figure.dpi
    figure.dpi = FigureCanvasSVG.fixed_dpi
    engine.execute(figure)
    if any(axes.get_aspect() != "auto" for axes in figure.axes):
        engine.execute(figure)  # axes of one scale both ways are not yet where they were measured
    figure.dpi = dpi
    figure.set_layout_engine(None)


def _tenth(digits: re.Match[str]) -> str:
    return f"{float(digits[0]):.1f}"


_FONTS = "DejaVu Sans, Verdana, Arial, sans-serif"  # the first was measured with; the others are hardly wider
_SHORTER = (
    (re.compile(r"<!--.*?-->", re.DOTALL), ""),
    (re.compile(r" font-family: [^;\"]*;?"), ""),  # one for the whole picture
    (re.compile(r'<g id="[^"]*">'), "<g>"),
    (re.compile(r"\s+"), " "),
    (re.compile(r"> <"), ">\n<"),
)
_COORDINATES = re.compile(r'(?<= d=")[^"]*')
_LONG = re.compile(r"\d+\.\d+")


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as SVG, whole or not at all."""
    write_bytes(path, svg(figure))


def save_together(figure_of: Mapping[str, Callable[[], Figure]], folder: Path) -> None:
    """Write figures as SVG, drawn on all cores.

    Parameters
    ----------
    figure_of : mapping of file name to a function without arguments
        Each makes the figure of its file.
    folder : Path
        Receives the files.
    """

    def saving(path: Path, figure: Callable[[], Figure]) -> Callable[[], None]:
        return lambda: save_figure(figure(), path)

    in_copies([saving(folder / name, figure) for name, figure in figure_of.items()])
