"""The pages in a real browser: nothing sticks out at the side, every picture shows, on a desk and on a phone."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests import light

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((found for found in map(shutil.which, BROWSERS) if found), None)
# put into a copy of the page: what a person would notice, written where --dump-dom prints it
PROBE = """<script>addEventListener("load", () => {
const images = [...document.images], tables = [...document.querySelectorAll(".scroll")];
const edge = document.documentElement.clientWidth + 1, inside = ".scroll, details:not([open])";
const wide = [...document.querySelectorAll("body *")].filter(
  e => !e.closest(inside) && e.getBoundingClientRect().right > edge);
document.body.dataset.found = [innerWidth, document.documentElement.scrollWidth, images.length,
  images.filter(i => i.complete && i.naturalWidth > 0).length, wide.length, tables.length].join(" ");
});</script>"""

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(BROWSER is None, reason=f"no browser: none of {', '.join(BROWSERS)} is installed"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    directory = tmp_path_factory.mktemp("browser") / "out"
    with pytest.MonkeyPatch.context() as patch:
        light.reproduce(directory, patch)
    return directory / "report.html"


def look(page: Path, width: int, *arguments: str) -> str:
    """Open a page without a window and return the document as the browser has it."""
    assert BROWSER is not None
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        f"--window-size={width},900",
    ]
    command += [f"--user-data-dir={page.parent / 'profile'}", "--virtual-time-budget=5000", *arguments, page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


@pytest.mark.parametrize("width", [500, 820, 1400])
def test_everything_shows_and_nothing_sticks_out(page, width):
    probed = page.with_name("probed.html")
    probed.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{PROBE}</body>"), encoding="utf-8")
    found = re.search(r'data-found="([\d ]+)"', look(probed, width, "--dump-dom"))
    assert found is not None
    inner, scroll, images, shown, wide, tables = map(int, found[1].split())
    assert inner == width
    assert scroll <= inner
    assert images == shown >= 8
    assert wide == 0
    assert tables >= 6


def test_the_page_is_not_blank(page):
    from matplotlib.image import imread

    picture = page.with_name("page.png")
    look(page, 1200, f"--screenshot={picture}")
    pixels = imread(picture)[..., :3]
    assert pixels.shape[:2] == (900, 1200)
    assert 0.02 < (pixels.min(axis=2) < 0.5).mean() < 0.5  # ink, but not only ink
