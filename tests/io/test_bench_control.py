"""What was set, where holds end, and clocks that start again: read off the recording, at any scale."""

import numpy as np
import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io import data_checks
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided
from wirebayes.io.experiment_file import read_experiments

MINUTES = np.array([0.0, 1, 2, 5, 10, 20, 30]) * 60.0


def read(path, length=1000.0, **choices):
    return convert(path, About("wire", "line", length), Choices(**choices))


def crept(weights, times, k1=900.0, share=0.02, k2=0.05, n=0.8):
    """Elongations in mm of 1 m under weights in N, (H, R): elastic, and creep that saturates at a share of it."""
    rows, before = [], 0.0
    for weight in weights:
        stretch = 1000.0 * weight / k1
        creep = before + (share * stretch - before) * (1 - np.exp(-k2 * times**n))
        rows.append(stretch + creep)
        before = creep[-1]
    return np.array(rows)


def by_hand(
    path,
    weights,
    noise_N=0.0,
    noise_mm=0.0,
    scale=(1.0, 1.0, 1.0),
    header="Load (N),Time (s),Extension (mm)",
    running=False,
    seed=0,
):
    """A test under weights, written down; scales of tension, length and time."""
    rng = np.random.default_rng(seed)
    x = crept(weights, MINUTES)
    lines = [header]
    for j, weight in enumerate(weights):
        for t, place in zip(MINUTES + 2000.0 * j * running, x[j], strict=True):
            values = weight + noise_N * rng.normal(), place + noise_mm * rng.normal(), t
            force, displacement, time = (v * s for v, s in zip(values, scale, strict=True))
            lines.append(f"{force:.6g},{time:.8g},{displacement:.8g}")
    path.write_text("\n".join(lines) + "\n")
    return path


WEIGHTS = [2.0, 4.0, 6.0, 8.0]


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1e-4, 0.01, 1.0), (3e4, 20.0, 60.0), (1.0, 1.0, 0.01)])
@pytest.mark.parametrize("noise", [0.0, 0.006])
@pytest.mark.parametrize("running", [False, True])
def test_a_test_under_weights_is_one_at_any_scale(tmp_path, scale, noise, running):
    path = by_hand(tmp_path / "raw.csv", WEIGHTS, noise, 0.003, scale, running=running)
    made = read(path, 1000.0 * scale[1], **({"time_since": "test"} if running else {}))
    holds = made.experiment.recorded_holds
    assert made.experiment.control == "force"
    assert [hold.setting for hold in holds] == pytest.approx(np.array(WEIGHTS) * scale[0], rel=0.01)
    assert all(hold.time_s == pytest.approx(MINUTES * scale[2]) for hold in holds)
    assert [hold.readings[-1] for hold in holds] == pytest.approx(crept(WEIGHTS, MINUTES)[:, -1] * scale[1], rel=0.01)


def test_unloading_recovers_under_weights_too(tmp_path):
    made = read(by_hand(tmp_path / "raw.csv", [8.0, 1.0, 8.0, 1.0], 0.006, 0.003))
    assert made.experiment.control == "force"


@pytest.mark.parametrize("unit", ["kg", "g", "lb"])
def test_masses_that_stay_are_weights(tmp_path, unit):
    made = read(by_hand(tmp_path / "raw.csv", [1.0, 2.0], header=f"Load ({unit}),Time (s),Extension (mm)"), 1e5)
    assert made.experiment.control == "force"
    factor = {"kg": 9.80665, "g": 0.00980665, "lb": 4.4482216152605}[unit]
    assert [hold.setting for hold in made.experiment.holds] == pytest.approx([factor, 2 * factor])


def twice_a_hold(path, unit, moved, of=4):
    """Weights read twice each by hand, the gauge moving under some of them."""
    lines = [f"Load ({unit});Minutes hanging;Ruler (mm)"]
    for hold in range(1, of + 1):
        second = 20 * hold + 1.5 * (hold <= moved)
        lines += [f"{2 * hold};1;{20 * hold}", f"{2 * hold};10;{second}"]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(("moved", "control"), [(4, "force"), (1, "force"), (0, "displacement")])
def test_masses_that_are_read_twice_each_are_weights_where_the_gauge_moves(tmp_path, moved, control):
    made = read(twice_a_hold(tmp_path / "raw.csv", "kg", moved), 2000.0, time_since="hold")
    assert made.experiment.control == control
    assert len(made.experiment.holds) == 4


def test_tensions_that_are_read_twice_each_and_stay_are_asked_about_where_most_displacements_do_not(tmp_path):
    path = twice_a_hold(tmp_path / "raw.csv", "N", moved=2)
    assert read(path, 2000.0, time_since="hold").experiment.control == "displacement"
    path = twice_a_hold(path, "N", moved=3)
    with pytest.raises(Undecided, match="tensions that stay within holds to the last digit, and displacements"):
        read(path, 2000.0, time_since="hold")
    assert read(path, 2000.0, time_since="hold", control="force").experiment.control == "force"


def test_a_step_test_that_is_read_twice_a_hold_is_one(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [(x + wobble, t, 2.0 * x - 0.1 * (t > 0)) for x in (1, 2, 3) for t, wobble in ((0, 0.0), (60, 0.01))]
    path.write_text("Extension (mm),Time (s),Load (kg)\n" + "\n".join(f"{x:.2f},{t},{y:.2f}" for x, t, y in rows))
    assert read(path, time_since="hold").experiment.control == "displacement"


def steps(path, scatter, relaxes, holds=5, readings=6, seed=0, drifts=0.0, grain=0.01):
    """A test of steps with a measured displacement; the tension is that of 2 N/mm."""
    rng = np.random.default_rng(seed)
    lines = ["Extension (mm),Time (s),Load (N)"]
    for h in range(1, holds + 1):
        for i in range(readings):
            part = 1 - np.exp(-i / 2.0)
            x = h + scatter * rng.normal() + drifts * part
            force = 2.0 * h * (1 - relaxes * part) + 0.003 * rng.normal()
            lines.append(f"{x:.4f},{20 * i},{np.round(force / grain) * grain:.4f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(("scatter", "relaxes"), [(0.01, 0.1), (0.01, 0.0), (0.05, 0.03), (0.0, 0.0), (0.002, 0.02)])
def test_a_displacement_that_scatters_is_a_step_test(tmp_path, scatter, relaxes):
    found = [read(steps(tmp_path / "raw.csv", scatter, relaxes, seed=seed)).experiment.control for seed in range(40)]
    assert found == ["displacement"] * 40


def test_a_coarse_load_cell_that_shows_no_relaxation_is_no_weight(tmp_path):
    found = [
        read(steps(tmp_path / "raw.csv", 0.01, 0.0, seed=seed, grain=0.5)).experiment.control for seed in range(40)
    ]
    assert found.count("force") <= 1


def test_where_both_drift_it_is_asked_and_an_answer_settles_it(tmp_path):
    path = steps(tmp_path / "raw.csv", 0.001, 0.05, drifts=0.15)
    with pytest.raises(Undecided, match="displacement and tension that both drift within holds, expected --control"):
        read(path)
    made = read(path, control="displacement")
    assert any("displacements drift by up to" in note for note in made.notes)
    assert read(path, control="force").experiment.control == "force"


def machine(path, weights, lasts=300.0, rate=2.0, ramp=3.0, noise_N=0.02, noise_mm=0.003, rest=0.0, seed=0):
    """A machine in force control: ramps and holds, recorded without a pause."""
    rng = np.random.default_rng(seed)
    n, m = int(lasts * rate), int(ramp * rate)
    x = crept(weights, (np.arange(n) + 0.5 * m) / rate)
    force, place, before = [0.0] * int(rest * rate), [0.0] * int(rest * rate), (0.0, 0.0)
    for weight, row in zip(weights, x, strict=True):
        force += [*np.linspace(before[0], weight, m + 1)[1:], *([weight] * n)]
        place += [*np.linspace(before[1], row[0], m + 1)[1:], *row]
        before = weight, row[-1]
    force = np.array(force) + noise_N * rng.normal(size=len(force))
    place = np.array(place) + noise_mm * rng.normal(size=len(place))
    rows = [f"{i / rate:.2f},{p:.4f},{f:.4f}" for i, (p, f) in enumerate(zip(place, force, strict=True))]
    path.write_text("Time (s),Position (mm),Force (N)\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("weights", [[2.0, 4.0, 6.0, 8.0], [8.0, 2.0, 8.0], [200.0, 400.0], [5.0]])
def test_a_machine_in_force_control_is_read_as_one(tmp_path, weights):
    noise = 0.0025 * max(weights)
    made = read(machine(tmp_path / "raw.csv", weights, noise_N=noise))
    holds = made.experiment.recorded_holds
    assert made.experiment.control == "force"
    assert [hold.setting for hold in holds] == pytest.approx(weights, abs=noise)
    # a hold lasts from the middle of the move to it to that of the next move
    assert [hold.duration_s for hold in holds[:-1]] == pytest.approx([303.0] * (len(weights) - 1), abs=2.0)
    assert all(hold.time_s[-1] < hold.duration_s for hold in holds[:-1])


def relaxed(path, rest=5.0, ramp=8.0, lasts=200.0, rate=10.0, level=0.7, at_rest=0.0, scale=1.0, back=0.0):
    """One relaxation: a rest, a ramp, a hold, perhaps a way back."""
    n = [int(v * rate) for v in (rest, ramp, lasts, back)]
    x = np.concatenate(
        [np.zeros(n[0]), np.linspace(0, level, n[1] + 1)[1:], np.full(n[2], level), np.linspace(level, 0, n[3] + 1)[1:]]
    )
    since = np.maximum(np.arange(len(x)) / rate - rest - 0.5 * ramp, 0.0)
    force = 3.0 * x * (1 - 0.4 * (1 - np.exp(-((since / 20.0) ** 0.5)))) + at_rest
    rows = [f"{i / rate:.1f},{scale * a:.6g},{f:.6f}" for i, (a, f) in enumerate(zip(x, force, strict=True))]
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("options", [{}, {"rest": 0.0}, {"back": 8.0}, {"scale": 100.0}, {"ramp": 40.0}])
def test_a_single_relaxation_begins_in_the_middle_of_its_ramp(tmp_path, options):
    made = read(relaxed(tmp_path / "raw.csv", **options), 14.0 * options.get("scale", 1.0))
    (hold,) = made.experiment.holds
    ramp = options.get("ramp", 8.0)
    assert hold.setting == pytest.approx(0.7 * options.get("scale", 1.0))
    assert ramp / 2 < hold.time_s[0] < 1.6 * ramp
    assert made.recording is not None
    assert made.recording.start_s[0] == pytest.approx(options.get("rest", 5.0) + ramp / 2, abs=0.2)
    assert data_checks.ONE_HOLD in [notice.text for notice in data_checks.of_experiment(made.experiment)]


def test_a_rest_under_tension_before_the_only_hold_is_not_dropped_in_silence(tmp_path):
    with pytest.raises(wb.InputError, match="one displacement that is held, from here on; the .* readings before were"):
        read(relaxed(tmp_path / "raw.csv", at_rest=0.5), 14.0)


def running(path, restarts=(), header="Time (s),Extension (mm),Load (N)", first=5, holds=8, within=False):
    """Eight holds by hand with a clock of the test, started again before some of them, or within one."""
    lines, start = [header], 0
    for h in range(1, holds + 1):
        if h in restarts and not within:
            start = -125 * (h - 1)
        for i in range(5):
            if within and h in restarts and i == 2:
                start -= 125 * (h - 1) + 60
            t = first + start + 125 * (h - 1) + 30 * i
            lines.append(f"{t},{h},{h * (1 - 0.05 * i / (i + 1)):.3f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("restarts", [(5,), (2,), (8,), (3, 6)])
def test_a_clock_that_is_started_again_once_or_twice_is_still_one_of_the_test(tmp_path, restarts):
    never, once = (read(running(tmp_path / "raw.csv", r)) for r in ((), restarts))
    assert once.rows == never.rows
    assert [row[2] for row in once.rows if row[3] is None] == [125.0] * 7
    assert any(f"time starts again at the beginning of hold {restarts[0]}" in note for note in once.notes)


def test_a_clock_that_starts_again_at_every_hold_is_one_of_the_hold(tmp_path):
    made = read(running(tmp_path / "raw.csv", range(2, 9)))
    assert [row[2] for row in made.rows[:5]] == [5.0, 35.0, 65.0, 95.0, 125.0]
    assert all(row[3] is not None for row in made.rows)


def test_a_clock_that_starts_again_within_a_hold_is_refused_with_its_line(tmp_path):
    with pytest.raises(wb.InputError, match=r"line 19, column 1 .*: found 5 s after .* s at 4 mm, expected times that"):
        read(running(tmp_path / "raw.csv", (4,), within=True))


def test_few_times_that_run_on_beside_one_that_does_not_are_asked_about(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [(1, 0), (1, 30), (2, 40), (2, 70), (3, 80), (3, 110), (4, 0), (4, 30), (5, 40), (5, 70)]
    path.write_text("x (mm),t (s),F (N)\n" + "".join(f"{x},{t},{2 * x - t / 1000}\n" for x, t in rows))
    assert read(path).rows[2][2:] == [40.0, None]  # seven orders of these times in a thousand run on so
    path.write_text("x (mm),t (s),F (N)\n" + "".join(f"{x},{t},{2 * x - t / 1000}\n" for x, t in rows[4:]))
    assert read(path).rows[0][2] == 80.0  # of the hold: one border in two is no habit


def recording(path, reset_at, gap_mm=0.0, rate=10.0, unit="s"):
    """A continuous recording of four holds whose logger is reset at a row; then the displacement may be elsewhere."""
    x = np.concatenate([[h + 0.0] * 600 + list(np.linspace(h, h + 1, 11)[1:]) for h in range(4)])
    time = np.arange(len(x)) / rate
    time[reset_at:] -= time[reset_at]
    x[reset_at:] += gap_mm
    factor = {"s": 1.0, "ms": 1000.0}[unit]
    rows = [f"{t * factor:.1f},{a:.3f},{2 * a + 1:.4f}\n" for t, a in zip(time, x, strict=True)]
    path.write_text(f"time_{unit},displacement_mm,force_N\n" + "".join(rows))
    return path


@pytest.mark.parametrize(("reset_at", "unit"), [(300, "s"), (1300, "ms"), (2000, "s")])
def test_pieces_of_a_recording_are_joined_where_the_displacement_goes_on(tmp_path, reset_at, unit):
    never = read(recording(tmp_path / "raw.csv", 0, unit=unit))
    made = read(recording(tmp_path / "raw.csv", reset_at, unit=unit))
    assert made.rows == never.rows
    assert any(f"time starts again at line {reset_at + 2}, where the displacement goes on" in n for n in made.notes)


def test_pieces_of_a_recording_elsewhere_are_refused_with_the_line_of_the_reset(tmp_path):
    with pytest.raises(wb.InputError, match=r"line 1302, column 1 .*: found 0 s after .* s, and 2.5 mm after 2, exp"):
        read(recording(tmp_path / "raw.csv", 1300, gap_mm=0.5))


def test_what_is_written_is_read_again(tmp_path):
    raw = by_hand(tmp_path / "raw.csv", WEIGHTS, 0.006, 0.003, running=True)
    made = wb.import_bench(raw, length_mm=1000, time_since="test", output=tmp_path / "out")
    (experiment,) = read_experiments(tmp_path / "out" / "raw.toml")
    assert experiment.control == "force"
    assert [hold.duration_s for hold in experiment.holds] == [2000.0] * 3 + [1800.0]
    assert 'control = "force"' in (tmp_path / "out" / "raw.toml").read_text()
    found = made.summary()["experiments"]["raw"]
    assert (found["control"], found["holds"], found["readings"]) == ("force", 4, 28)
