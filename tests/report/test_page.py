"""The page: self-contained, well formed, said of every command's folder, honest about what went wrong."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from matplotlib.figure import Figure

from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io import paper
from wirebayes.model.spec import ModelSpec
from wirebayes.report.blocks import (
    Page,
    Picture,
    Pictures,
    Section,
    Table,
    Text,
    View,
    as_sentence,
    number,
    span,
    unit_text,
)
from wirebayes.report.drawn import drawn, svg
from wirebayes.report.page import render, write_page
from wirebayes.report.pages import fit as fit_page
from wirebayes.results.jobs import Job, run
from wirebayes.results.read_back import load_posterior
from wirebayes.results.store import save_posterior
from wirebayes.sentences import quantity
from wirebayes.simulation.synthetic import Bench, Truth, draw

MOST_BYTES = 1_500_000
_VOID = {"meta", "img", "link", "br", "hr", "input"}
_FAST = Policy(walkers=32, ess=200.0, rounds=2, round_draws=1024, block=20, most_steps=40, r_hat=1.5)


class Reader(HTMLParser):
    """Checks nesting and collects what a reader sees."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.anchors: list[str] = []
        self.targets: list[str] = []
        self.words = ""
        self.hidden = False
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "img":
            self.images.append(values)
        if tag == "a":
            self.anchors.append(values["href"])
        if "id" in values:
            self.targets.append("#" + values["id"])
        assert tag not in ("link", "iframe"), f"a page needs no {tag}"
        assert tag != "script" or "src" not in values

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words += data.replace("\u00a0", " ")


def read(path: Path) -> Reader:
    """A page that must stand alone: all it needs is inside, its links lead within it or to files beside it."""
    text = path.read_text(encoding="utf-8")
    page = Reader(text)
    assert not re.search(r"src=\"(?!data:)", text), "something outside the page is needed"
    assert "@import" not in text
    assert "default-src 'none'" in text  # the browser itself lets nothing in from outside
    assert all(image["src"].startswith("data:image/") and image["alt"] for image in page.images)
    within = {anchor for anchor in page.anchors if anchor.startswith("#")}
    assert within <= set(page.targets)
    assert all((path.parent / unquote(file)).is_file() for file in set(page.anchors) - within)
    assert len(text.encode()) < MOST_BYTES
    return page


def said_twice(words: str) -> set[str]:
    """Runs of nine words that stand in two sentences of a page; two parameters may be known equally well by chance."""
    of_one_parameter = re.compile("it is correlated with|interval spans a factor of")
    sentences = re.split(r"\n|(?<=[.;:]) ", words)
    lines = [sentence.split() for sentence in sentences if not of_one_parameter.search(sentence)]
    each = [{" ".join(line[i : i + 9]) for i in range(len(line) - 8)} for line in lines]
    found = set[str]()
    for i, runs in enumerate(each):
        found |= runs & set().union(*each[:i])
    return found


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (699.152, 4, "699.2"),
        (699.152, 3, "699"),
        (0.02138, 3, "0.0214"),
        (7049.85, 4, "7\u202f050"),
        (99.96, 3, "100"),
        (0.9996, 3, "1.00"),
        (-0.5, 2, "−0.50"),
        (1.5e-7, 3, "1.50·10⁻⁷"),
        (2.5e7, 2, "2.5·10⁷"),
        (268112, 3, "268\u202f112"),
        (0.0, 3, "0"),
        (float("nan"), 3, "–"),
        (None, 3, "–"),
    ],
)
def test_numbers_for_people(value, digits, text):
    assert number(value, digits) == text


def test_intervals_and_units_for_people():
    assert span(1.0, 2.0, 2) == "1.0 … 2.0"
    assert span(970.0, 1010.0) == "970 … 1\u202f010"
    assert quantity(121.472, 121.09, 121.86, "N") == "121.5 N (121.1 … 121.9)"  # three digits would make it 121 … 122
    assert quantity(0.99997, 0.99994, 1.00001) == "0.99997 (0.99994 … 1.00001)"
    assert quantity(5.0, 5.0, 5.0) == "5.00 (5.00 … 5.00)"
    assert unit_text("mm N^-U") == "mm N⁻ᵁ"
    assert unit_text("1") == ""


def test_a_page_is_well_formed_and_escapes_its_content(tmp_path):
    figure = Figure(figsize=(2, 2))
    figure.subplots().plot([0, 1], [0, 1])
    nasty = "<b>&\"'"
    table = Table([nasty, "x"], [[nasty, nasty]], nasty, {nasty: "good"})
    picture = Pictures([Picture(drawn(figure), nasty, nasty)])
    page = Page(
        nasty, nasty, [Section(nasty, [Text(nasty), table, picture]), Section("folded", [Text("in")], True)], nasty
    )
    (tmp_path / "page.html").write_text(render(page), encoding="utf-8")
    found = read(tmp_path / "page.html")
    assert found.words.count(nasty) >= 9
    assert found.images[0]["alt"] == nasty


def test_a_picture_has_the_same_bytes_every_time():
    def one() -> bytes:
        figure = Figure(figsize=(2, 2))
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], clip_on=True)
        axes.scatter([0.5], [0.5], rasterized=True)
        return svg(figure)

    assert one() == one()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no configuration.json"),
        ("{", "no valid JSON"),
        ("[]", "found None"),
        ('{"command": "cook"}', "found 'cook'"),
        ('{"command": "pose"}', "pose.json: found no such file"),
    ],
)
def test_a_folder_that_is_not_ours_is_one_plain_line(content, message, tmp_path, capsys):
    if content is not None:
        (tmp_path / "configuration.json").write_text(content)
    assert main(["report", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "report.html").exists()


def folder_of(directory: Path, command: str, **files: object) -> Path:
    """A folder as a command leaves it."""
    directory.mkdir(exist_ok=True)
    (directory / "configuration.json").write_text(json.dumps({"command": command, "seed": 3}))
    for name, content in files.items():
        (directory / f"{name}.json").write_text(json.dumps(content))
    return directory


@pytest.fixture(scope="module")
def fitted(tmp_path_factory) -> Path:
    """Two short fits, hold by hold and as a chain."""
    directory = folder_of(tmp_path_factory.mktemp("fit") / "out", "fit")
    kite = next(e for e in paper.experiments() if e.name == "kite-1.5m")
    for likelihood in ("chain", "hold"):
        run([Job(likelihood, (kite,), spec=ModelSpec(likelihood=likelihood))], directory, 0, policy=_FAST)
    return directory


def test_the_page_of_a_fit_tells_known_from_unknown(fitted):
    page = read(write_page(fitted))
    assert "8 holds and 1 not recorded, 40 readings." in page.words
    assert "Tensions from 1.21 to 15.9 N." in page.words
    assert len(page.images) == 2 * (3 + 1) + 1  # readings, residuals, creep; all pairs; the curve of the chain
    assert "stiffness: the tension per unit of strain" in page.words
    assert "chain/posterior.nc" in page.anchors
    assert "Creep after 24 h at" in page.words
    assert page.words.count("not checked against the readings") == 2
    assert "What the readings determinek1: " in page.words  # of the chain; hold by hold the prior decides it too
    assert re.search("What the prior still decides.*k1: data and prior", page.words)


@pytest.mark.parametrize(("below", "way"), [(".", ""), ("page", "../"), ("../own page", "../out/")])
def test_a_page_in_another_folder_links_to_the_results(fitted, below, way):
    path = write_page(fitted, fitted / below)
    page = read(path)
    assert path == fitted / below / "report.html" and f"{way}chain/posterior.nc" in page.anchors
    assert (path.parent / way / "chain" / "posterior.nc").is_file()


def test_a_page_that_cannot_be_written_is_refused_in_a_line(fitted, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: cannot be written"):
        write_page(fitted, tmp_path / "file")
    with pytest.raises(InputError, match="found no configuration"):
        write_page(tmp_path, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def copied(fitted, folder):
    """A folder of the same posterior, whose summary is not written yet, and that summary."""
    copy = folder_of(folder, "fit")
    (copy / "chain").mkdir()
    (copy / "chain" / "posterior.nc").write_bytes((fitted / "chain" / "posterior.nc").read_bytes())
    return copy, json.loads((fitted / "chain" / "summary.json").read_text())


def test_a_fit_that_did_not_converge_says_so_first(fitted, tmp_path):
    copy, summary = copied(fitted, tmp_path / "out")
    for converged in (True, False):
        unsure = [] if converged else [{"kind": "not-converged", "text": "the chains stand apart"}]
        content = summary | {"converged": converged, "warnings": unsure}
        (copy / "chain" / "summary.json").write_text(json.dumps(content))
        first = read(write_page(copy)).words.split("What was measured")[0]
        assert ("The chains stand apart." in first) is not converged
    for passed, sentence in ((True, "Good."), (False, "Bad.")):
        check = {"passed": passed, "sentence": sentence, "gross_errors": []}
        failed = [] if passed else [{"kind": "model-check", "text": "bad"}]
        content = summary | {"model_check": check, "warnings": failed}
        (copy / "chain" / "summary.json").write_text(json.dumps(content))
        words = read(write_page(copy)).words
        assert check["sentence"] in words.split("What was measured")[0]
        for claim in ("What the prior still decides", summary["extrapolation"]["sentence"]):
            assert (claim in words) is check["passed"]
        assert summary["extrapolation"]["warning"] in words


def test_the_pages_of_a_fit_and_a_discovery_say_each_thing_once(fitted, tmp_path):
    fit = folder_of(tmp_path / "fit", "fit")
    (fit / "chain").symlink_to(fitted / "chain")
    page = read(write_page(fit))
    assert page.words.count("stretch that the wire already had at displacement zero") == 1
    assert said_twice(page.words) == set()
    sentence = "the residuals of the plain model bend with the displacement of the wire"
    pattern = [{"covariate": "displacement", "hold": None, "p": 0.001, "sentence": f"wire-a: {sentence}"}]
    content = {"version": 2, "experiments": {"wire-a": DISCOVERY | {"where": pattern}}, "warnings": []}
    found = folder_of(tmp_path / "found", "discover", discovery=content)
    (found / "wire-a").mkdir()
    (found / "wire-a" / "where-displacement.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    assert "stretch that the wire already had" in read(write_page(found)).words  # in the glossary: no table says it
    for model in ("plain", "final"):
        (found / "wire-a" / model).symlink_to(fitted / "chain")
    page = read(write_page(found))
    assert page.words.count(sentence) == 1 and "Residuals of the plain model by displacement." in page.words
    assert page.words.count("stretch that the wire already had") == 1
    assert said_twice(page.words.rpartition("What the words and symbols mean")[0]) == set()


def test_a_fit_with_effects_of_the_users_own_runs_none_of_their_code(fitted, tmp_path):
    copy = folder_of(tmp_path / "out", "fit")
    (copy / "configuration.json").write_text(json.dumps({"command": "fit", "own_effects": "raise SystemExit(7)"}))
    (copy / "chain").mkdir()
    (copy / "chain" / "summary.json").write_bytes((fitted / "chain" / "summary.json").read_bytes())
    assert "shows summary.json alone" in read(write_page(copy)).words


def test_the_table_of_creep_names_its_tension_its_length_and_what_it_includes(fitted, tmp_path):
    copy, summary = copied(fitted, tmp_path / "out")
    of = {"tension_N": 4.25, "length_mm": 730.0}
    derived = summary["derived"] | of | {"final_creep_mm": None, "median_creep_time_s": None}
    (copy / "chain" / "summary.json").write_text(json.dumps(summary | {"derived": derived}))
    words = read(write_page(copy)).words
    assert "A fresh sample of 730 mm held at 4.25 N, the tension at which one of the holds began. All fitted" in words
    assert "grows without end" in words and "stiffness there, N per unit strain" in words


FEW = [{"kind": "few-holds", "text": "2 holds: no effect can be established"}]
DISCOVERY = {
    "warnings": [],
    "verdict": "named",
    "effects": ["strain_stiffening"],
    "best": "strain_stiffening",
    "set": ["strain_stiffening"],
    "group": ["strain_stiffening", "sensor_nonlinearity"],
    "accepted": ["strain_stiffening"],
    "amplitudes": {"strain_stiffening": {"mean": 12.0, "q05": 9.0, "q95": 15.0, "unit": "-", "hold": None}},
    "probabilities": {"unknown": 0.01, "strain_stiffening": 0.97},
    "inclusion": {"strain_stiffening": 0.98},
    "remainder": {"probability": 0.02, "where": [], "p": 0.4},
    "steps": [
        {"model": "plain", "rmse_N": 0.1, "elpd": 1.0, "coverage_90": 0.4},
        {"model": "strain_stiffening", "rmse_N": 0.03, "elpd": 9.0, "coverage_90": 0.9},
    ],
    "p_global": 0.001,
    "p_simulations": 999,
    "shared_with": [],
    "where": [{"covariate": "displacement", "hold": None, "p": 0.001, "sentence": "Residuals bend with displacement."}],
    "held_out": {
        "holds": [9, 10],
        "plain": {"rmse_N": 0.1, "elpd": 1.0},
        "final": {"rmse_N": 0.03, "elpd": 9.0, "elpd_difference_se": 2.0},
        "gap_closed": 0.9,
        "floor_N": 0.02,
    },
    "power": {"toe": {"amplitude_80": 1.2, "unit": "-"}},
    "not_identifiable": ["gain of the force sensor"],
    "next_measurement": "Unload in steps of 2 mm.",
}


WORSE = DISCOVERY["held_out"] | {"final": {"rmse_N": 0.2, "elpd": 9.0, "elpd_difference_se": 2.0}}


@pytest.mark.parametrize("changes", [{}, {"verdict": "unknown", "effects": [], "accepted": [], "amplitudes": {}}])
def test_a_page_says_of_a_name_that_it_is_the_nearest_of_the_catalogue(changes, tmp_path):
    content = {"experiments": {"wire-a": DISCOVERY | changes}}
    page = read(write_page(folder_of(tmp_path / "out", "discover", discovery=content)))
    assert ("an effect that the catalogue lacks gets this name too" in page.words) == (not changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "On this protocol hard to distinguish from sensor nonlinearity."),
        (
            {"group": ["strain_stiffening"]},
            "is missing (the wire becomes stiffer (or softer) the more it is strained), of size 12.0 (9.00 … 15.0); ",
        ),
        ({}, "; with it the error on held-out holds falls from 0.100 to 0.0300 N (p < 0.001)."),
        ({"held_out": WORSE}, "; but with it the error on held-out holds grows from 0.100 to 0.200 N (p < 0.001)."),
        ({"held_out": WORSE}, "On the held-out holds 9 and 10 the rms error grows from 0.10 to 0.20 N"),
        ({}, "The wire becomes stiffer (or softer) the more it is strained. τ = k1 s (1 + c s)."),
        ({"verdict": "nothing-missing", "effects": [], "amplitudes": {}, "probabilities": {}}, "nothing is missing"),
        (
            {"verdict": "nothing-missing", "effects": [], "amplitudes": {}, "probabilities": {}, "p_global": 0.4},
            "One pattern of several may stand out by chance; the global test decides (p = 0.4).",
        ),
        (
            {"verdict": "nothing-missing", "effects": [], "amplitudes": {}, "probabilities": {}, "where": []},
            "No pattern stands out.",
        ),
        ({"verdict": "unknown", "effects": [], "set": ["unknown"]}, "that no effect in the catalogue explains"),
        (
            {"verdict": "unknown", "effects": [], "probabilities": {"unknown": 0.2, "strain_stiffening": 0.8}},
            "something is missing that has no established name; its largest part may be strain stiffening (80 %)",
        ),
        (
            {"verdict": "unknown", "effects": [], "probabilities": {}, "warnings": FEW},
            "wire-a: something is missing; so few holds do not say what",
        ),
        (
            {"verdict": "partial"},
            "the more it is strained), of size 12.0 (9.00 … 15.0); and so is something that no effect in the catalogue "
            "explains; with both the error",
        ),
        (
            {"verdict": "partial", "effects": ["toe", "ageing"]},
            "and so is something that no effect in the catalogue explains; with all of them",
        ),
        ({}, "that none of them explains remains with a probability of 2 %"),
        (
            {"verdict": "ambiguous", "set": ["toe", "ageing"], "probabilities": {"toe": 0.7, "ageing": 0.25}},
            "these readings do not tell what: toe (70 %) or ageing (25 %)",
        ),
    ],
)
def test_the_page_of_a_discovery_says_the_verdict_and_what_to_measure_next(changes, message, tmp_path):
    content = {"version": 2, "experiments": {"wire-a": DISCOVERY | changes, "wire-b": DISCOVERY}, "warnings": []}
    page = read(write_page(folder_of(tmp_path / "out", "discover", discovery=content)))
    assert message in page.words
    assert "Unload in steps of 2 mm." in page.words
    assert "On the held-out holds 9 and 10 the rms error falls from 0.10 to 0.030 N" in page.words
    assert "90 %" in page.words


CHECKED = {
    "material": "line", "control": "displacement", "length_mm": 1000.0, "recorded_holds": 2, "unrecorded_holds": 1,
    "readings": 6,
    "duration_s": 360.0, "warnings": [{"kind": "data", "text": "hold 2 repeats hold 1"}],
    "holds": [{"number": None, "displacement_mm": 5.0, "start_s": 0.0, "duration_s": 120.0, "readings": 0,
               "first_s": None, "first_N": None, "last_N": None}],
    "parameters": {"k1": {"unit": "N", "q05": 1.0, "q50": 2.0, "q95": 3.0, "prior_q05": 0.5, "prior_q95": 9.0,
                          "determined_by": "prior"}},
    "effects": {
        "toe": {"shows": "yes", "amplitude_80": 0.00123, "unit": "-", "reason": None},
        "guide_friction": {"shows": "no", "amplitude_80": None, "unit": "-", "reason": "unloading branch"},
    },
}  # fmt: skip


def test_the_page_of_a_check_says_what_is_odd_and_what_the_test_cannot_tell(tmp_path):
    content = {"experiments": {"wire-a": CHECKED}}
    page = read(write_page(folder_of(tmp_path / "out", "check", check=content)))
    assert "Hold 2 repeats hold 1." in page.words and "0.00123" in page.words
    assert "it does not determine k1, it would show" in page.words and "k1 is about" not in page.words
    assert page.words.count("stiffness: the tension per unit of strain") == 1
    assert (
        "Effects it cannot show: guide friction." in page.words
        and "Parameters it does not determine: k1." in page.words
    )


def test_the_page_of_an_import_says_what_was_done(tmp_path):
    about = {
        "raw": "bench.xlsx",
        "holds": 3,
        "readings": 9,
        "length_mm": 1000.0,
        "material": "line",
        "notes": ["decimal comma"],
        "warnings": [],
    }
    content = {"experiments": {"wire-a": about}}
    page = read(write_page(folder_of(tmp_path / "out", "import", **{"import": content})))
    assert "wire-a: 3 holds, 9 readings, 1000 mm of line." in page.words
    assert "From bench.xlsx." in page.words and "Decimal comma." in page.words


def test_a_gap_below_the_floor_is_a_dash(tmp_path):
    content = DISCOVERY | {"held_out": DISCOVERY["held_out"] | {"gap_closed": None}, "p_global": None, "steps": []}
    page = read(write_page(folder_of(tmp_path / "out", "discover", discovery={"experiments": {"wire-a": content}})))
    above = page.words.rpartition("What the words and symbols mean")[0]
    assert "–" in above and "90 %" not in above


def test_the_page_of_a_pose_that_cannot_be_held_says_so(tmp_path):
    pose = {
        "robot": "table",
        "mass_kg": 2.0,
        "feasible": False,
        "sentence": "No tensions within the bounds hold the platform at this pose.",
        "pose": {"position_m": [0.0, 0.1, 0.25], "rotation_vector_rad": [0.0, 0.0, 0.0]},
        "warnings": [
            {"kind": "slack", "text": "wire 3 is slack"},
            {"kind": "unheld", "text": "no tensions within the bounds hold the platform at this pose"},
        ],
    }
    page = read(write_page(folder_of(tmp_path / "out", "pose", pose=pose)))
    assert "No tensions within the bounds hold the platform" in page.words
    assert "Wire 3 is slack." in page.words


def test_the_page_of_a_comparison_lists_models_and_failures(tmp_path):
    good = {"name": "plain", "failed": None, "weight": 0.75, "difference": {"elpd": 0.0, "se": 0.0}, "held_out": None}
    good |= {"elastic_law": "hooke", "history": "saturating", "likelihood": "chain", "effects": []}
    bad = {"name": "toe", "failed": "no finite start", "meaning": ""}
    models = [good | {"meaning": "the base"}, bad]
    content = {"experiments": {"wire-a": {"base": "plain", "models": models, "warnings": []}}}
    page = read(write_page(folder_of(tmp_path / "out", "compare", comparison=content)))
    assert "no finite start" in page.words
    assert "0.75" in page.words and "the base" in page.words


def test_the_page_of_an_export_shows_the_creep_and_leads_to_the_files(tmp_path):
    out = folder_of(tmp_path / "out", "export")
    table = "tension_N,time_s,mean_mm_per_m,sd_mm_per_m,q05_mm_per_m,q50_mm_per_m,q95_mm_per_m\n"
    (out / "creep-table.csv").write_text(table + "2,60,0.5,0.1,0.4,0.51,0.6\n2,3600,1.5,0.1,1.4,1.53,1.6\n")
    (out / "klipper.cfg").write_text("[printer]\n")
    left_out = [{"kind": "left-out", "text": "no firmware settings"}]
    (out / "export.json").write_text(json.dumps({"files": [], "creep_table": [], "warnings": left_out}))
    page = read(write_page(out))
    assert "1.53" in page.words and "1.40 … 1.60" in page.words
    assert {"creep-table.csv", "klipper.cfg"} <= set(page.anchors)
    assert "robot.xml" not in page.anchors
    assert "No firmware settings." in page.words


def test_the_page_of_a_simulation_tells_the_truth(tmp_path):
    out = tmp_path / "out"
    assert main(["simulate", "--effect", "toe.w=2", "--parameter", "k1=712", "--output", str(out)]) == 0
    page = read(write_page(out))
    assert "Beyond the plain model: toe." in page.words
    assert "712" in page.words and "2.00" in page.words
    assert "truth.json" in page.anchors


def test_sentences_in_a_table_may_break_and_numbers_may_not():
    table = Table(["a", "b", "c"], [["x" * 50, "1.23 … 4.56", "Words that go on and on for more than a number would."]])
    assert table.prose == {2}


def test_a_dense_layer_is_drawn_as_an_image_and_letters_as_text():
    figure = Figure(figsize=(2, 2))
    axes = figure.subplots()
    axes.plot(np.arange(5000) % 7, label="noise")
    axes.set_xlabel("time, s")
    picture = svg(figure).decode()
    assert "data:image/png" in picture and ">time, s</text>" in picture
    assert len(picture) < 60_000


def test_a_scene_cannot_end_its_script():
    scene = {"exits": [], "name": "</script><b>"}
    assert "<" not in View(scene, "").data
    assert json.loads(View(scene, "").data) == scene


def test_an_unfinished_reproduction_shows_what_there_is(tmp_path):
    row = {
        "experiment": "wire-a",
        "material": "Line",
        "length_mm": 1000.0,
        "holds": 3,
        "unrecorded_holds": 0,
        "readings": 15,
        "smallest_tension_N": 1.0,
        "largest_tension_N": 2.0,
        "median_loss_percent": 5.0,
    }
    page = read(write_page(folder_of(tmp_path / "out", "reproduce", measured=[row])))
    assert "wire-a" in page.words and "Table 4, again" not in page.words


def test_bars_of_intervals_stand_where_the_numbers_are():
    """Read back from the drawn figure: a wrong column would shift a bar."""
    from wirebayes.paper.figures import intervals

    row = {"parameter": "k1", "published": 2.0, "q05": 4.0, "q50": 5.0, "q95": 6.0, "prior_q05": 1.0, "prior_q95": 20.0}
    axes = intervals([row | {"likelihood": kind} for kind in ("chain", "hold")], "wire").axes[0]
    bars = [line.get_xdata() for line in axes.lines if len(line.get_xdata()) == 2 and line.get_linewidth() > 3]
    assert [list(np.asarray(bar)) for bar in bars] == [[2.0, 3.0], [0.5, 10.0], [2.0, 3.0]]


def test_ticks_of_pairs_are_few_round_and_within_their_cells() -> None:
    from wirebayes.report.pictures.corner import _few_ticks

    places, labels = _few_ticks(np.linspace(-0.31, 0.31, 1000), False)
    assert labels == ["−0.2", "0", "0.2"]
    np.testing.assert_allclose(np.diff(places), places[1] - places[0])
    assert places[1] == pytest.approx(0.5)
    assert _few_ticks(np.linspace(-0.5, 0.5, 1000), True)[1] == ["0.5", "1", "2"]
    assert _few_ticks(np.linspace(-2.0, 2.0, 1000), True)[1] == ["0.1", "1", "10"]
    for decades in (0.7, 1.3, 4.0, 9.0, 40.0):
        places, labels = _few_ticks(np.linspace(-decades / 2, decades / 2, 1000), True)
        assert 1 <= len(labels) <= 4
        assert (places > 0.04).all()
        assert (places < 0.96).all()


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("sensor_sd,", ["sensor_sd,"]),
        ("tension_dependent_rate.m", ["tension_", "dependent_rate.m"]),
        ("second_relaxation.time_s", ["second_", "relaxation.time_s"]),
        ("a" * 30, ["a" * 30]),
        ("", [""]),
    ],
)
def test_a_long_name_stays_within_its_cell(name: str, lines: list[str]) -> None:
    """Seventeen letters a line, broken after underscores, nothing lost."""
    from wirebayes.report.pictures.corner import _narrow

    found = _narrow(name)
    assert found.split("\n") == lines and found.replace("\n", "") == name


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("kite-1.5m: its readings end early", "kite-1.5m: its readings end early."),
        ("the final model: k1 is open.", "The final model: k1 is open."),
        ("", "."),
    ],
)
def test_a_sentence_begins_with_a_large_letter_unless_it_begins_with_a_name(text, sentence):
    assert as_sentence(text) == sentence


def test_what_is_left_of_displacements_is_in_mm(tmp_path):
    """Under weights displacements are read."""
    made = draw([Bench(times_s=(0.0, 30.0, 60.0), weights_N=(2.0, 4.0, 6.0), resolution_mm=0.0)], Truth(), 3)
    save_posterior(fit_problem(made.problem, 1, policy=_FAST), tmp_path, {})
    stored = load_posterior(tmp_path)
    assert fit_page._residuals(stored).axes[0].get_ylabel() == "measured − predicted, mm"
