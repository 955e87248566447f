"""The pages in a real browser, at the width of a phone, a tablet and a desk.

Nothing is cut off or overlaps, nothing is asked from outside, nothing is said on the console, axe-core finds no fault
with contrast, names and order, tables are sorted and robots turned by the keyboard.
"""

import csv
import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests import light
from tests.browser import chromium
from wirebayes.report.page import write_page
from wirebayes.report.pages.predict import write_beside

WIDTHS = (360, 820, 1400)
RESULTS = Path(__file__).parents[1] / "data" / "results"
# what a person would notice: parts beyond the right edge that cannot be scrolled to, pictures that do not show,
# letters over letters, parts of a page over each other
FAULTS = """(() => {
  const edge = document.documentElement.clientWidth + 1, folded = ".scroll, .formula, details:not([open]) *";
  const shown = e => e.getClientRects().length > 0, named = e => e.outerHTML.slice(0, 90);
  const wide = [...document.querySelectorAll("body *")].filter(
    e => shown(e) && !e.closest(folded) && e.getBoundingClientRect().right > edge).map(named);
  const lost = [...document.images].filter(i => !(i.complete && i.naturalWidth > 0)).map(i => i.alt);
  const parts = [...document.querySelectorAll("main > section > *, header > *")].filter(shown);
  const boxes = parts.map(e => e.getBoundingClientRect());
  const meet = (a, b) => a.top < b.bottom - 1 && a.bottom > b.top + 1;
  const over = parts.filter((e, i) => i > 0 && meet(boxes[i - 1], boxes[i])).map(named);
  const labels = [...document.querySelectorAll("figure.view text.wire")].map(e => e.getBoundingClientRect());
  const cut = labels.filter(r => r.left < 0 || r.right > edge).length;
  const small = [...document.querySelectorAll("td, th, p, li, dd, figcaption")].filter(
    e => shown(e) && parseFloat(getComputedStyle(e).fontSize) < 12).length;
  const burst = [...document.querySelectorAll("td, th")].filter(
    e => shown(e) && e.scrollWidth > e.clientWidth + 1).map(named);
  return {burst, scroll: document.documentElement.scrollWidth, wide, lost, over, cut, small};
})()"""

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        chromium.EXECUTABLE is None, reason=f"no browser: none of {', '.join(chromium.NAMES)} is installed"
    ),
]


@cache
def axe() -> str:
    """The text of axe-core, from where WIREBAYES_AXE says, the folder of global packages, or the registry npm knows."""
    file = Path(os.environ.get("WIREBAYES_AXE", "absent"))
    npm = shutil.which("npm")
    if not file.is_file() and npm:
        where = subprocess.run([npm, "root", "--global"], capture_output=True, text=True, check=False).stdout.strip()
        file = Path(where or "absent") / "axe-core" / "axe.min.js"
    if not file.is_file() and npm:
        cache_folder = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "wirebayes"
        file = cache_folder / "node_modules" / "axe-core" / "axe.min.js"
        if not file.is_file():
            cache_folder.mkdir(parents=True, exist_ok=True)
            command = [npm, "install", "--no-audit", "--no-fund", "--prefix", str(cache_folder), "axe-core@4"]
            subprocess.run(command, capture_output=True, timeout=120, check=False)
    if not file.is_file():
        pytest.skip("no axe-core: not in WIREBAYES_AXE, not installed globally, and npm could not install it")
    return file.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def tab(tmp_path_factory) -> Iterator[chromium.Tab]:
    with chromium.tab(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory) -> dict[str, Path]:
    """A page of every kind of result, the fits behind them short."""
    folder = tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch:
        light.reproduce(folder / "reproduce", patch)
        patch.chdir(folder)
        commands_of(folder)
    return {path.parent.name: path for path in sorted(folder.glob("*/report.html"))}


def commands_of(folder: Path) -> None:
    """Every other command, in the cheapest form that draws all it can draw."""
    import wirebayes as wb

    few = light.POLICY
    wire = wb.simulate_tests(displacements=[1, 2, 3, 4, 3, 2], times=[0, 30, 60], seed=1, output=folder / "simulate")
    tests = wire.experiments
    fitted = wb.fit(tests, check=False, policy=few, output=folder / "fit")
    wb.discover(tests, policy=few, simulations=49, output=folder / "discover")
    wb.compare(tests, only="exponential", policy=few, output=folder / "compare")
    wb.check(tests, output=folder / "check")
    wb.plan(tests[0], tests=20, output=folder / "plan")
    wb.batch(tests, discover=False, check=False, policy=few, output=folder / "batch")
    wb.pose("linear-7", fitted, times=[0, 60, 600], draws=40, output=folder / "pose")
    poses_over_time(folder, fitted)
    wb.export("hangprinter-4", fitted, draws=50, output=folder / "export")
    rows = ["Weg [mm];Zeit [s];Kraft [N]", "1,5;0;2,12", "1,5;30;1,91", "1,5;60;1,86", "3,0;0;4,02", "3,0;45;3,88"]
    (folder / "bench.csv").write_text("\n".join(rows))
    wb.import_bench("bench.csv", length_mm=1000, material="line", output=folder / "import")
    shutil.copytree(RESULTS / "calibrate", folder / "calibrate")
    for name in KINDS[1:]:
        if name != "predict":
            write_page(folder / name)
    (folder / "predict").mkdir()
    later = {"hold": [7, 7, 8, 8], "displacement_mm": [5, 5, 6, 6], "time_s": [0, 60, 0, 60]}
    table = folder / "predict" / "report.csv"
    write_beside(wb.predict(fitted, later, output=table), table)


def poses_over_time(folder: Path, wires) -> None:
    """Commanded poses with a payload, and a log of the same with everything that can be measured."""
    import wirebayes as wb

    moved = wb.pose("linear-7", wires, trajectory=WAY, draws=10, output=folder / "pose-trajectory").folder
    columns: dict[str, list[float]] = {}
    for name in ("poses.csv", "corrections.csv"):
        with (moved / name).open(newline="") as file:
            rows = list(csv.DictReader(file))
        columns |= {key: [float(row[key]) for row in rows] for key in rows[0]}
    log = dict(WAY)
    for i in range(1, 8):
        corrected, change_mm = columns[f"joint_{i}_m"], columns[f"change_{i}_mm"]
        log[f"joint_{i}_m"] = [joint - 1e-3 * change for joint, change in zip(corrected, change_mm, strict=True)]
        log[f"tension_{i}_N"] = columns[f"tension_{i}_N"]
    nothing = dict.fromkeys(("rx_rad", "ry_rad", "rz_rad", "roll_deg", "pitch_deg"), [0.0] * 5)
    wb.pose("linear-7", wires, joints=log | nothing, draws=10, output=folder / "pose-joints")


WAY = {
    "time_s": [0, 60, 600, 660, 3600],
    "x_m": [0, 0.1, 0.1, -0.1, -0.1],
    "y_m": [0, 0, 0, 0.05, 0.05],
    "z_m": [0.6, 0.6, 0.6, 0.65, 0.65],
    "payload_kg": [0, 0.2, 0.2, 0, 0],
}
KINDS = (
    "reproduce", "batch", "calibrate", "check", "compare", "discover", "export", "fit", "import", "plan", "pose",
    "pose-joints", "pose-trajectory", "predict", "simulate",
)  # fmt: skip


def test_there_is_a_page_of_every_kind(pages):
    assert set(pages) == set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_off_or_asked_from_outside(kind, pages, tab):
    for width in WIDTHS:
        tab.open(pages[kind], width)
        found = tab.run(FAULTS)
        assert found.pop("scroll") <= width
        assert found == {"burst": [], "wide": [], "lost": [], "over": [], "cut": 0, "small": 0}, width
        assert tab.errors == []
        assert tab.requests == [pages[kind].as_uri()]
    assert pages[kind].stat().st_size < 1_500_000


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("kind", KINDS)
def test_the_first_screen_holds_the_answer_and_then_its_picture(kind, width, pages, tab):
    """Within 900 px: one sentence with number, unit and how sure that is; then the picture, before tables and cards."""
    tab.open(pages[kind], width)
    lead = " ".join(tab.run("document.querySelector('.lead').textContent").split())
    assert lead in tab.run(FIRST_SCREEN)
    assert len(SENTENCE_END.findall(lead)) == 1 and NUMBER_WITH_UNIT.search(lead), lead
    assert kind in ("import", "simulate") or HOW_SURE.search(lead), lead  # these two state what is known exactly
    shown = tab.run("[...document.querySelectorAll('main img, main table, main .columns')].map(e => e.tagName)")
    top = tab.run("document.querySelector('main img').getBoundingClientRect().top")
    assert shown[0] == "IMG" and top < 900, (shown[:3], top)


SENTENCE_END = re.compile(r"[.!?](?= [A-Z]|$)")
NUMBER_WITH_UNIT = re.compile(r"\d[\d.\u202f]*( …|\))? (mm|N|s|min|degrees|elpd|in elpd)\b|p [=<] 0?\.\d")
HOW_SURE = re.compile(r" … | ± |\[.+, .+\]|p [=<] 0?\.\d|standard error")


# the text whose lines all end above the fold
FIRST_SCREEN = """(() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), range = document.createRange();
  const seen = [];
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (box.height > 0 && box.bottom <= 900) seen.push(node.textContent);
  }
  return seen.join(" ").replace(/\\s+/g, " ");
})()"""


def test_a_link_opens_the_section_that_is_folded(pages, tab):
    tab.open(pages["reproduce"], 1280)
    folded = "[...document.querySelectorAll('section > details')]"
    assert tab.run(f"{folded}.filter(d => !d.open).length") > 5
    tab.run("document.querySelector('nav a[href=\"#figures-1-to-4\"]').click()")
    tab.wait_for("document.querySelector('#figures-1-to-4 > details').open")


SCHEMES = [(kind, "light") for kind in KINDS] + [(kind, "dark") for kind in ("reproduce", "discover", "pose", "check")]


@pytest.mark.parametrize(("kind", "scheme"), SCHEMES)
def test_axe_finds_nothing_wrong(kind, scheme, pages, tab):
    tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    for width in (WIDTHS[0], WIDTHS[-1]):
        tab.open(pages[kind], width)
        grounds = tab.run(
            "['body', 'figure img'].map(s => getComputedStyle(document.querySelector(s)).backgroundColor)"
        )
        assert scheme == "light" or grounds == ["rgb(20, 24, 27)", "rgb(255, 255, 255)"]
        tab.run(f"document.querySelectorAll('details').forEach(d => d.open = true); {axe()}; 0")
        found = tab.run(
            "axe.run({preload: false}).then(r => r.violations.map(v => [v.id, v.nodes.map(n => n.html.slice(0, 90))]))"
        )
        assert found == []


def test_a_table_is_sorted_by_the_keyboard(pages, tab):
    tab.open(pages["fit"], 1400)
    column = "[...document.querySelectorAll('table tbody')].map(b => [...b.rows].map(r => r.cells[2].textContent))[0]"
    before = tab.run(column)
    tab.run("document.querySelectorAll('table')[0].tHead.rows[0].cells[2].querySelector('button').focus()")
    seen = []
    for _ in range(2):
        tab.press("Enter", 13, "\r")
        seen.append([float(text.replace("\u202f", "").replace("−", "-")) for text in tab.run(column)])
    assert seen[0] == sorted(seen[0]) == seen[1][::-1]
    assert len(seen[0]) == len(before) > 4
    assert tab.run("document.querySelectorAll('th[aria-sort=descending]').length") == 1


def test_a_robot_is_turned_by_the_keyboard_and_followed_in_time(pages, tab):
    tab.open(pages["pose"], 820)
    points = "[...document.querySelectorAll('figure.view circle')].map(c => c.outerHTML).join()"
    first = tab.run(points)
    tab.run("document.querySelector('figure.view button').focus()")
    tab.press("Enter", 13, "\r")
    turned = tab.run(points)
    assert turned != first
    tab.run("document.querySelector('figure.view input').focus()")
    assert tab.run("document.querySelector('figure.view output').textContent") == "10 min"
    tab.press("Home", 36)
    assert tab.run("document.querySelector('figure.view output').textContent") == "0 s"
    assert tab.run(points) != turned


@pytest.mark.parametrize("flat", [0, 1, 2, None])
def test_a_planar_robot_is_looked_at_squarely(flat, pages, tab, tmp_path):
    """Its exit points span the picture in both directions, whichever plane it lies in."""
    scene = json.loads((pages["pose"].parent / "scene.json").read_text())
    if flat is not None:
        for points in (scene["exits"], scene["platform"], *scene["drifted"]):
            for point in points:
                point[flat] = 0.0
    text = pages["pose"].read_text(encoding="utf-8")
    text = re.sub(r'(<script type="application/json">).*?(</script>)', rf"\g<1>{json.dumps(scene)}\2", text)
    page = tmp_path / "flat.html"
    page.write_text(text, encoding="utf-8")
    tab.open(page, 820)
    assert tab.errors == []
    spans = tab.run(
        "['x', 'y'].map(a => [...document.querySelectorAll('figure.view rect')].map(r => +r.getAttribute(a)))"
        ".map(v => Math.max(...v) - Math.min(...v))"
    )
    assert min(spans) > 100 and max(spans) < 460
    shown = tab.run("[...document.querySelectorAll('figure.view text.axis')].map(t => t.textContent).join('')")
    assert shown == "xyz".replace("xyz"[flat], "") if flat is not None else "xyz"


def test_what_is_wrong_would_be_found(tab, tmp_path):
    page = tmp_path / "wrong.html"
    page.write_text(
        "<!doctype html><html lang=en><title>x</title><body><main><section><p>a</p><p style='margin-top:-3em'>b</p>"
        "<div style='width:2000px'>wide</div><img src='absent.png' alt='lost'>"
        "<script>undefined_name()</script></section></main></body></html>"
    )
    tab.open(page, 360)
    found = tab.run(FAULTS)
    assert found["wide"] and found["lost"] == ["lost"] and found["over"] and found["scroll"] > 360
    assert tab.errors and len(tab.requests) == 2
