"""Colours of pages, light and dark: every text stands out from what is behind it, and pictures lie on paper."""

import re
from importlib import resources

import pytest

CSS = (resources.files("wirebayes.report") / "page.css").read_text()
LEAST = 4.5  # of the Web Content Accessibility Guidelines, level AA, for text of a usual size
TEXTS = ("ink", "lead", "soft", "chain", "good", "bad", "open")
SIGNS = {"mark": 3.0, "edge": 3.0, "hold": 3.0}  # the same guidelines for signs that are no text


def colours(scheme):
    """The colours of a scheme by name; the dark one names all of the light one's anew."""
    light, _, rest = CSS.partition("@media screen and (prefers-color-scheme: dark)")
    dark = rest.partition("/*")[0]
    found = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", light if scheme == "light" else dark))
    assert found.keys() == dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", light)).keys()
    return found


def luminance(colour):
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("behind", ["paper", "wash"])
def test_every_text_stands_out(scheme, behind):
    known = colours(scheme)
    for name, least in dict.fromkeys(TEXTS, LEAST).items() | SIGNS.items():
        assert contrast(known[name], known[behind]) >= least, (name, known[name])


def test_a_dark_page_is_dark_and_pictures_are_drawn_on_paper():
    known = colours("dark")
    assert luminance(known["paper"]) < 0.02 < 0.6 < luminance(known["ink"])
    dark = CSS.partition("prefers-color-scheme: dark")[2]
    assert re.search(r"\.pictures img, figure\.view svg \{ background: #ffffff", dark)


def test_no_rule_has_a_colour_of_its_own():
    """One that a dark page does not change would be read on the wrong ground."""
    rules = CSS.partition("* { box-sizing")[2]
    assert re.findall(r"#[0-9a-f]{3,6}\b", rules) == []


def test_a_printed_page_is_light():
    assert re.findall(r"@media ([^{]*prefers-color-scheme[^{]*)\{", CSS) == ["screen and (prefers-color-scheme: dark) "]
