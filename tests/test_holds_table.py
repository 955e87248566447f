"""The table of holds that ``check`` prints."""

from wirebayes.answers.holds_table import holds_table


def hold(number, tension_N, read=(5.0, 6.0)):
    first, last = read if number else (None, None)
    return {
        "number": number,
        "tension_N": tension_N,
        "start_s": 0.0,
        "duration_s": 60.0,
        "readings": 2 if number else 0,
        "first_s": 0.0 if number else None,
        "first_mm": first,
        "last_mm": last,
    }


def test_a_rest_has_no_weight_and_a_small_weight_is_one():
    holds = [hold(1, 20.0), hold(None, 20e-6), hold(2, 40.0), hold(None, 0.001)]
    _, *lines = holds_table({"control": "force", "holds": holds}, "mm")
    settings = [line[6:20].strip() for line in lines]
    assert settings == ["20 N", "no weight", "40 N", "0.001 N"]
    assert lines[1].endswith("none: held, not recorded")
