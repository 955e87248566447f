"""A Bayesian toolkit for wires that creep.

``import wirebayes as wb`` offers what the command line does as functions. Names are loaded when they are first used, so
the import itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wirebayes._version import __version__ as __version__

if TYPE_CHECKING:
    from wirebayes.errors import InputError as InputError
    from wirebayes.inference.policy import Policy as Policy
    from wirebayes.io.arrays import from_arrays as from_arrays
    from wirebayes.io.experiment import Experiment as Experiment
    from wirebayes.io.experiment import read_experiments as read_experiments
    from wirebayes.prediction.table import Prediction as Prediction
    from wirebayes.robot.history.live import LiveEstimator as LiveEstimator
    from wirebayes.robot.history.live import LivePose as LivePose
    from wirebayes.robot.mechanics.description import Robot as Robot
    from wirebayes.workflows.batch import batch as batch
    from wirebayes.workflows.calibrate import calibrate as calibrate
    from wirebayes.workflows.check import check as check
    from wirebayes.workflows.compare import compare as compare
    from wirebayes.workflows.discover import discover as discover
    from wirebayes.workflows.export import export as export
    from wirebayes.workflows.fit import fit as fit
    from wirebayes.workflows.import_bench import import_bench as import_bench
    from wirebayes.workflows.import_robot import import_robot as import_robot
    from wirebayes.workflows.list_effects import EffectDescription as EffectDescription
    from wirebayes.workflows.list_effects import list_effects as list_effects
    from wirebayes.workflows.live import live as live
    from wirebayes.workflows.load import load as load
    from wirebayes.workflows.new_experiment import new_experiment as new_experiment
    from wirebayes.workflows.plan import plan as plan
    from wirebayes.workflows.pose import pose as pose
    from wirebayes.workflows.predict import predict as predict
    from wirebayes.workflows.reproduce_paper import reproduce_paper as reproduce_paper
    from wirebayes.workflows.results import Batch as Batch
    from wirebayes.workflows.results import Calibration as Calibration
    from wirebayes.workflows.results import Check as Check
    from wirebayes.workflows.results import Comparison as Comparison
    from wirebayes.workflows.results import Export as Export
    from wirebayes.workflows.results import Findings as Findings
    from wirebayes.workflows.results import ImportedTests as ImportedTests
    from wirebayes.workflows.results import Plan as Plan
    from wirebayes.workflows.results import Pose as Pose
    from wirebayes.workflows.results import Posterior as Posterior
    from wirebayes.workflows.results import Posteriors as Posteriors
    from wirebayes.workflows.results import Reproduction as Reproduction
    from wirebayes.workflows.results import SimulatedTests as SimulatedTests
    from wirebayes.workflows.simulate_tests import simulate_tests as simulate_tests
    from wirebayes.workflows.wires import read_robot as read_robot
    from wirebayes.workflows.write_report import write_report as write_report

_PLACES = {
    "read_experiments": "wirebayes.io.experiment",
    "from_arrays": "wirebayes.io.arrays",
    "import_bench": "wirebayes.workflows.import_bench",
    "new_experiment": "wirebayes.workflows.new_experiment",
    "check": "wirebayes.workflows.check",
    "fit": "wirebayes.workflows.fit",
    "compare": "wirebayes.workflows.compare",
    "discover": "wirebayes.workflows.discover",
    "batch": "wirebayes.workflows.batch",
    "plan": "wirebayes.workflows.plan",
    "predict": "wirebayes.workflows.predict",
    "simulate_tests": "wirebayes.workflows.simulate_tests",
    "load": "wirebayes.workflows.load",
    "read_robot": "wirebayes.workflows.wires",
    "import_robot": "wirebayes.workflows.import_robot",
    "pose": "wirebayes.workflows.pose",
    "live": "wirebayes.workflows.live",
    "calibrate": "wirebayes.workflows.calibrate",
    "export": "wirebayes.workflows.export",
    "list_effects": "wirebayes.workflows.list_effects",
    "write_report": "wirebayes.workflows.write_report",
    "reproduce_paper": "wirebayes.workflows.reproduce_paper",
    "Experiment": "wirebayes.io.experiment",
    "Posterior": "wirebayes.workflows.results",
    "Posteriors": "wirebayes.workflows.results",
    "Batch": "wirebayes.workflows.results",
    "Prediction": "wirebayes.prediction.table",
    "Findings": "wirebayes.workflows.results",
    "Plan": "wirebayes.workflows.results",
    "Comparison": "wirebayes.workflows.results",
    "ImportedTests": "wirebayes.workflows.results",
    "Check": "wirebayes.workflows.results",
    "SimulatedTests": "wirebayes.workflows.results",
    "Robot": "wirebayes.robot.mechanics.description",
    "LiveEstimator": "wirebayes.robot.history.live",
    "LivePose": "wirebayes.robot.history.live",
    "Pose": "wirebayes.workflows.results",
    "Calibration": "wirebayes.workflows.results",
    "Export": "wirebayes.workflows.results",
    "Reproduction": "wirebayes.workflows.results",
    "EffectDescription": "wirebayes.workflows.list_effects",
    "Policy": "wirebayes.inference.policy",
    "InputError": "wirebayes.errors",
}

__all__ = ["__version__", *_PLACES]  # noqa: PLE0604 - names of the table


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'wirebayes' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_PLACES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
