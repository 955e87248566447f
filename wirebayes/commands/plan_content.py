"""What ``plan.json`` says of tests that were judged."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.commands.wires import RobotLike
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.plan import JudgedProtocol, PlanJson, RobotDrift
from wirebayes.json_files.values import Statistics
from wirebayes.model.sample import MATERIAL
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.typing import Floats
from wirebayes.planning.guess import GuessedWire
from wirebayes.planning.ranking import Judged, too_long
from wirebayes.planning.widths import CREEP, HOUR_S
from wirebayes.result_warnings import Notice, to_json
from wirebayes.results.contraction import interval
from wirebayes.robot.mechanics import draws as robot_draws
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, material
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import drift
from wirebayes.robot.motion.home import home_notices
from wirebayes.robot.motion.plausible import robot_notices
from wirebayes.wire.model import Model

_ROBOT_DRAWS = 60  # of the posterior of each simulated test that moves a robot


@dataclass(frozen=True)
class PlanRequest:
    """What is to be judged."""

    tests: list[tuple[Experiment, str]]
    guess: GuessedWire
    aim: tuple[str, ...]
    budget_min: float | None
    robot: RobotLike | None
    about: dict[str, Any]
    spec: ModelSpec

    @property
    def model(self) -> Model:
        """Of the guessed wire, with the laws that tests are fitted with."""
        return replace(self.guess.model, law=self.spec.law, history=self.spec.history)


def protocol_content(judged: Judged, request: PlanRequest, rank: int, machine: Robot | None) -> JudgedProtocol:
    """A protocol as it stands in ``plan.json``.

    Parameters
    ----------
    judged : Judged
    request : PlanRequest
    rank : int
        1 is the best.
    machine : Robot, optional
        Whose drift within an hour is foreseen.
    """
    test = judged.test
    expected = judged.expected
    seen = judged.sensitivity
    widths = expected.widths
    cosines = {f"{one} {other}": cosine for (one, other), cosine in seen.cosines.items() if one < other}
    recorded = test.recorded_holds
    readings = sum(hold.time_s.size for hold in recorded)
    robot = None
    if machine is not None and not machine.is_on_given_wires:
        robot = _drift(judged, request, machine)
    return {
        "rank": rank,
        "name": test.name,
        "words": judged.words,
        "length_mm": test.length_mm,
        "holds": len(recorded),
        "readings": readings,
        "duration_min": judged.duration_min,
        "within_budget": not too_long(judged, request.budget_min),
        "score": judged.score(request.aim),
        "information_bits": expected.information_bits,
        "simulated_tests": expected.tests,
        "parameters": {name: width for name, width in widths.items() if name not in CREEP},
        "creep": {
            "tension_N": expected.tension_N,
            "length_mm": expected.length_mm,
            "longest_hold_s": expected.longest_hold_s,
            "creep_longest_hold_mm": widths["creep_longest_hold_mm"],
            "creep_1h_mm": widths["creep_1h_mm"],
        },
        "effects": seen.effects,
        "cosines": cosines,
        "not_identifiable": list(seen.hidden),
        "robot": robot,
    }


def plan_content(rows: list[JudgedProtocol], request: PlanRequest, machine: Robot | None) -> PlanJson:
    """The content of ``plan.json``.

    Parameters
    ----------
    rows : list of dict
        The protocols, the best first.
    request : PlanRequest
    machine : Robot, optional
    """
    guess = request.guess
    notices = [*_over_budget(rows[0], request.budget_min), *_of_robot(machine), *guess.doubts]
    return {
        "version": 1,
        "aim": list(request.aim),
        "budget_min": request.budget_min,
        "best": rows[0]["name"],
        "guess": {
            "source": guess.source,
            "length_mm": guess.length_mm,
            "parameters": {name: _statistics(values) for name, values in guess.draws.items()},
        },
        "robot": None if machine is None else machine.name,
        "protocols": rows,
        "warnings": to_json(notices),
    }


def _over_budget(best: JudgedProtocol, budget_min: float | None) -> list[Notice]:
    """A notice that no test is done within the time there is, if none is."""
    if best["within_budget"]:
        return []
    return [Notice("budget", f"no test is done within {budget_min:g} min")]


def _of_robot(machine: Robot | None) -> list[Notice]:
    """What speaks against the file of a robot, and that its drift does not depend on the line that is tested, if so."""
    if machine is None:
        return []
    out = [*robot_notices(machine), *home_notices(machine)]
    if not machine.is_on_given_wires:
        return out
    text = (
        f"no test of this line changes the drift of {machine.name}: its file gives the parameters of all its wires; "
        "leave them out, or write fitted = true under [wires.NAME]"
    )
    return [*out, Notice("left-out", text)]


def _drift(judged: Judged, request: PlanRequest, machine: Robot) -> RobotDrift | None:
    """How well the drift of a robot within an hour would be known, and is at the guess; None where nothing holds it."""
    after = []
    for draws in judged.expected.draws:
        distances = _distances_mm(draws, judged.test.length_mm, machine, judged.expected.model)
        if len(distances) > 1:
            after.append([float(np.median(distances)), float(distances.std())])
    if not after:  # nothing holds the home pose
        return None
    guess = request.guess
    at_guess = _distances_mm(guess.draws, guess.length_mm, machine, request.model)
    drift_mm, drift_sd_mm = np.median(after, axis=0)
    return {
        "time_s": HOUR_S,
        "drift_mm": float(drift_mm),
        "drift_sd_mm": float(drift_sd_mm),
        "drift_sd_guess_mm": float(at_guess.std()) if len(at_guess) > 1 else np.nan,
    }


def _distances_mm(parameters: dict[str, Any], length_mm: float, machine: Robot, model: Model) -> Floats:
    """How far the platform is from its home pose after an hour, for some draws of the line; without those that fail."""
    names = list(MATERIAL)
    for effect in material(model.effects):
        names += effect.columns()
    few = {name: parameters[name][:_ROBOT_DRAWS] for name in names}
    line = WireDraws(
        few,
        length_mm,
        model.law,
        model.history,
        model.effects,
        tension_ref_N=model.tension_ref_N,
        typical=model.typical,
    )
    wires = robot_draws.for_robot(machine, line)
    rotation = matrix(machine.home_rotation_rad)
    course = drift.from_command(machine, wires, machine.home_m, rotation, np.array([0.0, HOUR_S]))
    away_m = course.position_m[:, -1] - machine.home_m
    return 1e3 * np.linalg.norm(away_m, axis=1)[course.found]


def _statistics(values: Any) -> Statistics:
    low, middle, high = interval(values)
    return {"mean": float(values.mean()), "sd": float(values.std()), "q05": low, "q50": middle, "q95": high}
