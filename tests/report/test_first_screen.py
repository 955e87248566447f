"""What a page says first: grave warnings, then the answer with number, unit and interval."""

from wirebayes import sentences
from wirebayes.answers import headline, terminal
from wirebayes.report.blocks import Notices, Page, Section, Table, Text, with_fixed_spaces
from wirebayes.report.page import render
from wirebayes.result_warnings import Notice

SUMMARY = {
    "experiment": "kite",
    "converged": True,
    "parameters": {"k1": {"unit": "N", "q50": 882.4, "q05": 850.0, "q95": 910.0}},
    "derived": {"tension_N": 4.5, "creep_2min_mm": {"q50": 1.234, "q05": 1.1, "q95": 1.4}},
}


def test_grave_warnings_stand_before_the_answer_and_once() -> None:
    grave, light = Notices([Notice("slack", "a wire is slack")]), Notices([Notice("sag", "a wire sags")])
    html = render(Page("T", "The answer.", [Section("A", [grave, Text("Then."), light])]))
    assert html.count("A wire is slack.") == 1
    assert html.index("A wire is slack.") < html.index("The answer.") < html.index("A wire sags.")
    assert Page("T", "The answer.", [Section("A", [light])]).grave is None


def test_the_answer_of_a_fit_has_number_unit_and_interval() -> None:
    said = headline.fit_in_a_sentence(SUMMARY)  # type: ignore[arg-type]
    assert said == (
        "kite creeps by 1.23 mm (1.10 … 1.40) within 2 min under 4.5 N, and its stiffness is 882 N "
        "(850 … 910) per unit of strain; 90 % intervals in brackets."
    )
    bands = {
        f"creep_{time}_mm": {"q50": q, "q05": q, "q95": q} for time, q in (("2min", 1.0), ("1h", 2.0), ("1day", 3.0))
    }
    for held_s, within in (
        (3599.0, "1.00 mm (1.00 … 1.00) within 2 min"),
        (3600.0, "(2.00 … 2.00) within 1 h"),
        (86399.0, "(2.00 … 2.00) within 1 h"),
        (86400.0, "(3.00 … 3.00) within 24 h"),
    ):
        long = SUMMARY | {"longest_hold_s": held_s, "derived": bands | {"tension_N": 4.5}}
        assert within in headline.fit_in_a_sentence(long)  # type: ignore[arg-type]
        (creep,) = (line for line in terminal.of_fit(long | {"effects": []}) if "creep after" in line)
        assert f"creep after {within.rpartition('within ')[2]} at 4.5 N" in creep
    failed = SUMMARY | {"model_check": {"passed": False}}
    assert headline.fit_in_a_sentence(failed).startswith("If the model were right: ")  # type: ignore[arg-type]


def test_an_answer_of_samples_of_two_lengths_says_of_which_length_it_is() -> None:
    bands = SUMMARY["derived"] | {"length_mm": 800.0}  # type: ignore[operator]
    amount = {"B": {"unit": "mm N^-U", "q50": 0.1, "q05": 0.09, "q95": 0.11}}
    for of_amount, of_creep, of_law in ((1131.371, "in 800 mm of wire", "in 1131 mm of wire"), (800.0 + 1e-12, "", "")):
        both = SUMMARY | {"derived": bands, "B_length_mm": of_amount, "parameters": amount, "effects": []}
        said = f" under 4.5 N {of_creep}".rstrip()
        assert f"{said}; 90 %" in headline.fit_in_a_sentence(both)  # type: ignore[arg-type]
        lines = "\n".join(terminal.of_fit(both))  # type: ignore[arg-type]
        assert f" at 4.5 N {of_creep}".rstrip() + ": " in lines
        assert f"  creep law {of_law}".rstrip() + ": B" in lines


def test_a_fit_that_says_nothing_of_stiffness_says_how_much_the_wire_creeps() -> None:
    said = headline.fit_in_a_sentence(SUMMARY | {"parameters": {}})  # type: ignore[arg-type]
    assert said == "kite creeps by 1.23 mm (1.10 … 1.40) within 2 min under 4.5 N; 90 % interval in brackets."


def test_a_comparison_is_a_ranking_in_words() -> None:
    rows = [
        {"name": "toe", "failed": None, "difference": {"elpd": 12.3, "se": 3.2}},
        {"name": "plain", "failed": None, "difference": {"elpd": 0.0, "se": 0.0}},
        {"name": "ageing", "failed": "no fit", "difference": None},
    ]
    table = {"base": "plain", "models": rows}
    assert headline.comparison_in_words("a", table) == (  # type: ignore[arg-type]
        "a: toe predicts left-out holds best, by 12 ± 3.2 elpd (log probability of their readings) against "
        "plain; then comes plain."
    )
    for elpd, se, chance in ((4.0, 2.0, False), (3.99, 0.1, True), (12.3, 6.2, True)):
        rows[0]["difference"] = {"elpd": elpd, "se": se}
        said = headline.comparison_in_words("a", table)  # type: ignore[arg-type]
        assert ("against plain, which may be chance; then" in said) == chance


def test_where_the_plain_model_is_the_best_it_is_said_by_how_much() -> None:
    rows = [
        {"name": "plain", "failed": None, "difference": {"elpd": 0.0, "se": 0.0}},
        {"name": "toe", "failed": None, "difference": {"elpd": -9.3, "se": 2.0}},
        {"name": "ageing", "failed": None, "difference": {"elpd": -20.0, "se": 3.0}},
    ]
    ahead = "a: plain predicts left-out holds best, by 9.3 ± 2.0 elpd (log probability of their readings) against toe"
    for models, rest in ((rows, "; then comes ageing."), (rows[:2], ".")):
        table = {"base": "plain", "models": models}
        assert headline.comparison_in_words("a", table) == ahead + rest  # type: ignore[arg-type]
    rows[1]["difference"] = None  # another likelihood, whose elpd is of something else
    table = {"base": "plain", "models": rows[:2]}
    assert headline.comparison_in_words("a", table) == "a: plain predicts left-out holds best; then comes toe."  # type: ignore[arg-type]


def test_a_batch_says_a_sentence_a_finding_and_no_plural_of_one() -> None:
    stiff = [{"k1": {"q50": middle, "q05": middle - 20.0, "q95": middle + 20.0}} for middle in (900.0, 930.0, 990.0)]
    row = {"error": None, "check": None, "verdict": "nothing-missing", "material": "m", "converged": True}
    row = row | {"effects": list[str]()}
    rows = [
        row | {"name": "a", "parameters": stiff[0]},
        row | {"name": "b", "parameters": stiff[1], "verdict": "named", "effects": ["toe"]},
    ]
    found = {"experiments": rows, "outliers": []}
    assert headline.batch_in_sentences(found) == [  # type: ignore[arg-type]
        "2 tests of one material, 2 converged; median k1 of m 915 N (900 … 930, least to largest specimen).",
        "In one test (a) nothing is missing that the readings can show.",
        "Toe is missing in one test (b).",
    ]
    rows.append(row | {"name": "c", "parameters": stiff[2], "material": "other"})
    assert headline.batch_in_sentences(found)[0] == (  # type: ignore[arg-type]
        "3 tests of 2 materials, 3 converged; median k1 of m 915 N (900 … 930, least to largest specimen), "
        "k1 of other 990 N (970 … 1\u202f010, 90 % interval)."
    )


def test_a_batch_does_not_say_of_undecided_effects_that_each_is_missing() -> None:
    row = {"error": None, "check": None, "material": None, "converged": True, "parameters": {}}
    rows = [
        row | {"name": "a", "verdict": "ambiguous", "effects": ["toe", "power_strain"]},
        row | {"name": "b", "verdict": "ambiguous", "effects": ["power_strain", "toe"]},
        row | {"name": "c", "verdict": "partial", "effects": ["toe"]},
    ]
    assert headline.batch_in_sentences({"experiments": rows, "outliers": []})[1:] == [  # type: ignore[arg-type]
        "Toe is missing in one test (c).",
        "Power strain or toe is missing in 2 tests (a and b); these readings do not tell which.",
        "Something that has no established name is missing in one test (c).",
    ]


def test_times_are_said_in_the_unit_that_people_use() -> None:
    said = [sentences.lasting(seconds) for seconds in (0.5, 59.0, 60.0, 3599.0, 3600.0, 86400.0, 3 * 86400.0, 2.16e6)]
    assert said == ["0.5 s", "59 s", "1 min", "60 min", "1 h", "24 h", "3 days", "25 days"]


def test_times_to_be_set_are_whole_numbers_of_the_longest_unit_or_stay_seconds() -> None:
    said = [sentences.to_be_held(seconds) for seconds in (0.0, 0.5, 744.99, 1500.0, 5399.9999999999, 5400.0, 162000.0)]
    assert said == ["0 s", "0.5 s", "745 s", "25 min", "90 min", "90 min", "45 h"]


def test_two_forms_of_an_effect_are_told_apart() -> None:
    names = ("steady_creep", "steady_creep@carried", "toe", "toe@strain", "grip_slip@4", "unknown")
    said = [sentences.spoken(name) for name in names]
    assert said[4:] == ["grip slip at hold 4", "something unknown"]
    assert len(set(said)) == len(names)


def test_the_first_sentence_breaks_neither_an_interval_nor_a_number_from_its_unit() -> None:
    said = with_fixed_spaces("It creeps by 0.2 mm (0.1 … 0.3) within 2 min; 25 ± 3.8 against 4 %, and then again.")
    fixed = [piece for piece in said.split(" ") if "\u00a0" in piece]
    assert [piece.replace("\u00a0", " ") for piece in fixed] == ["0.2 mm", "(0.1 … 0.3)", "2 min;", "25 ± 3.8", "4 %,"]


def test_a_large_number_has_the_digits_that_say_something() -> None:
    said = [
        sentences.number(value, digits) for value, digits in ((612429.3, 3), (8954.3, 3), (12345.6, 2), (98765.4, 5))
    ]
    assert said == ["612\u202f400", "8\u202f954", "12\u202f350", "98\u202f765"]


def test_columns_of_words_begin_at_the_left_and_those_with_a_number_at_the_right() -> None:
    rows = [["a", "Nylon", "1.2", "−3", "–"], ["b", "4 mm rope", "–", "< 0.01", "–"], ["c", "no", "2", "4", "yes"]]
    assert Table(["name"] * 5, rows).names == {4}
    assert Table(["name"] * 5, [rows[0], rows[2]]).names == {1, 4}


def test_a_platform_that_cannot_tilt_is_not_said_to_tilt() -> None:
    def course(last: float) -> dict[str, list[float]]:
        return {"q05": [0.0, 0.9 * last], "q50": [0.0, last], "q95": [0.0, 1.1 * last]}

    drift = {"times_s": [0.0, 3600.0], "distance_mm": course(4.0), "specimen_spread": 0.05}
    for tilt, said in (
        (0.0, "moves by 4.00 mm (3.60 … 4.40) within 1 h of"),
        (2.0, " and tilts by 2.00 (1.80 … 2.20) deg"),
    ):
        pose = {"robot": "r", "feasible": True, "drift": [drift | {"tilt_deg": course(tilt)}]}
        assert said in headline.pose_in_a_sentence(pose)  # type: ignore[arg-type]


def test_a_calibration_says_first_what_became_of_the_exit_points() -> None:
    known = {"converged": True, "length_m": {"sd": [0.0048, 0.005]}}
    points = {"sd": [[0.002, 0.003, 0.001], [0.002, 0.002, 0.002]]}
    found = {"robot": "r", "with_creep_model": known, "read": 30, "holds": 30, "exit_points_m": points}
    found |= {"prior": {"anchor_sd_mm": 10.0}}
    assert headline.calibration_in_a_sentence(found) == (  # type: ignore[arg-type]
        "The exit points of r's 2 wires are known to 1.0 … 3.0 mm (before: 10.0 mm), their zero-tension lengths to "
        "4.8 … 5.0 mm (standard errors), from 30 of 30 holds."
    )
    exact = found | {"exit_points_m": {"sd": [[0.0] * 3] * 2}}
    assert headline.calibration_in_a_sentence(exact).startswith("The zero-tension lengths of r's 2 wires")  # type: ignore[arg-type]


def test_the_size_of_one_of_several_is_not_said_of_all() -> None:
    held = {"plain": {"rmse_N": 0.2}, "final": {"rmse_N": 0.02}}
    report = {"verdict": "ambiguous", "effects": ["toe", "power_strain"], "families": [], "held_out": held}
    report |= {"set": ["toe", "power_strain"], "probabilities": {"toe": 0.6, "power_strain": 0.35}}
    report |= {"amplitudes": {"toe": {"mean": 2.9, "q05": 2.5, "q95": 3.2, "unit": "mm", "hold": None}}}
    report |= {"p_global": 0.002, "p_simulations": 499}
    assert headline.findings_in_a_sentence("a", report) == (  # type: ignore[arg-type]
        "a: something is missing; these readings do not tell what: toe (60 %) or power strain (35 %); with toe of "
        "2.90 mm (2.50 … 3.20) the error on held-out holds falls from 0.200 to 0.0200 N (p < 0.01)."
    )
