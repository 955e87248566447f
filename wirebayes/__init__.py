"""A Bayesian toolkit for wires that creep.

``import wirebayes as wb`` offers what the command line does as functions. Names are loaded when they are first used, so
the import itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wirebayes._version import __version__ as __version__

if TYPE_CHECKING:
    from wirebayes.commands.batch import batch as batch
    from wirebayes.commands.calibrate import calibrate as calibrate
    from wirebayes.commands.check import check as check
    from wirebayes.commands.compare import compare as compare
    from wirebayes.commands.discover import discover as discover
    from wirebayes.commands.export import export as export
    from wirebayes.commands.fit import fit as fit
    from wirebayes.commands.import_bench import import_bench as import_bench
    from wirebayes.commands.import_robot import import_robot as import_robot
    from wirebayes.commands.list_effects import EffectDescription as EffectDescription
    from wirebayes.commands.list_effects import list_effects as list_effects
    from wirebayes.commands.live import live as live
    from wirebayes.commands.load import load as load
    from wirebayes.commands.new_experiment import new_experiment as new_experiment
    from wirebayes.commands.plan import plan as plan
    from wirebayes.commands.pose import pose as pose
    from wirebayes.commands.predict import predict as predict
    from wirebayes.commands.reproduce_paper import reproduce_paper as reproduce_paper
    from wirebayes.commands.simulate_tests import simulate_tests as simulate_tests
    from wirebayes.commands.wires import read_robot as read_robot
    from wirebayes.commands.write_report import write_report as write_report
    from wirebayes.errors import InputError as InputError
    from wirebayes.inference.policy import Policy as Policy
    from wirebayes.io.arrays import from_arrays as from_arrays
    from wirebayes.io.experiment import Experiment as Experiment
    from wirebayes.io.experiment_file import read_experiments as read_experiments
    from wirebayes.prediction.table import Prediction as Prediction
    from wirebayes.robot.history.live import LiveEstimator as LiveEstimator
    from wirebayes.robot.history.live_pose import LivePose as LivePose
    from wirebayes.robot.mechanics.description import Robot as Robot
    from wirebayes.views.batch import Batch as Batch
    from wirebayes.views.calibration import Calibration as Calibration
    from wirebayes.views.check import Check as Check
    from wirebayes.views.comparison import Comparison as Comparison
    from wirebayes.views.export import Export as Export
    from wirebayes.views.findings import Findings as Findings
    from wirebayes.views.imported_tests import ImportedTests as ImportedTests
    from wirebayes.views.plan import Plan as Plan
    from wirebayes.views.pose import Pose as Pose
    from wirebayes.views.posterior import Posterior as Posterior
    from wirebayes.views.posterior import Posteriors as Posteriors
    from wirebayes.views.reproduction import Reproduction as Reproduction
    from wirebayes.views.simulated_tests import SimulatedTests as SimulatedTests

_PLACES = {
    "read_experiments": "wirebayes.io.experiment_file",
    "from_arrays": "wirebayes.io.arrays",
    "import_bench": "wirebayes.commands.import_bench",
    "new_experiment": "wirebayes.commands.new_experiment",
    "check": "wirebayes.commands.check",
    "fit": "wirebayes.commands.fit",
    "compare": "wirebayes.commands.compare",
    "discover": "wirebayes.commands.discover",
    "batch": "wirebayes.commands.batch",
    "plan": "wirebayes.commands.plan",
    "predict": "wirebayes.commands.predict",
    "simulate_tests": "wirebayes.commands.simulate_tests",
    "load": "wirebayes.commands.load",
    "read_robot": "wirebayes.commands.wires",
    "import_robot": "wirebayes.commands.import_robot",
    "pose": "wirebayes.commands.pose",
    "live": "wirebayes.commands.live",
    "calibrate": "wirebayes.commands.calibrate",
    "export": "wirebayes.commands.export",
    "list_effects": "wirebayes.commands.list_effects",
    "write_report": "wirebayes.commands.write_report",
    "reproduce_paper": "wirebayes.commands.reproduce_paper",
    "Experiment": "wirebayes.io.experiment",
    "Posterior": "wirebayes.views.posterior",
    "Posteriors": "wirebayes.views.posterior",
    "Batch": "wirebayes.views.batch",
    "Prediction": "wirebayes.prediction.table",
    "Findings": "wirebayes.views.findings",
    "Plan": "wirebayes.views.plan",
    "Comparison": "wirebayes.views.comparison",
    "ImportedTests": "wirebayes.views.imported_tests",
    "Check": "wirebayes.views.check",
    "SimulatedTests": "wirebayes.views.simulated_tests",
    "Robot": "wirebayes.robot.mechanics.description",
    "LiveEstimator": "wirebayes.robot.history.live",
    "LivePose": "wirebayes.robot.history.live_pose",
    "Pose": "wirebayes.views.pose",
    "Calibration": "wirebayes.views.calibration",
    "Export": "wirebayes.views.export",
    "Reproduction": "wirebayes.views.reproduction",
    "EffectDescription": "wirebayes.commands.list_effects",
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
