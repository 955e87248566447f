"""What the robot's commands are given: a fitted wire, lists of numbers, a schedule of times."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wirebayes.results.store import Stored
    from wirebayes.robot.mechanics.draws import WireDraws


def read_wires(folder: Path, count: int, experiment: str | None = None, own_effects: Path | None = None) -> "WireDraws":
    """Draws of a fitted line as the robot takes them, evenly thinned; an `InputError` names what is wrong."""
    from wirebayes.errors import InputError
    from wirebayes.results.store import load

    below = sorted(str(path.parent) for path in folder.glob("*/**/posterior.nc"))
    if below and not (folder / "posterior.nc").is_file():
        raise InputError(f"{folder}: found no posterior.nc in it, expected one of {', '.join(below)}")
    stored = load(folder, experiment, own_effects)
    if stored.likelihood == "hold":
        raise InputError(
            f"{folder}: found a fit with --likelihood hold, which does not determine the stiffness k1; expected one "
            "with --likelihood chain, for a robot needs k1"
        )
    return wire_draws(stored, count)


def wire_draws(stored: "Stored", count: int) -> "WireDraws":
    """Material parameters of a stored posterior with what was tested; bench quantities stay behind."""
    import numpy as np

    from wirebayes.robot.mechanics.draws import CORE, LENGTH_EXPONENT, WireDraws, material

    sample = stored.sample
    effects = tuple(sample.model.effects)
    names = [*CORE, *(c for e in material(effects) for c in e.columns())]
    pick = np.unique(np.linspace(0, len(stored.draws["k1"]) - 1, count).round().astype(int))
    protocol, readings = sample.protocol, sample.readings[..., 0][sample.protocol.mask]
    parameters = {name: stored.draws[name][pick] for name in names}
    if stored.length_exponent is not None:
        parameters[LENGTH_EXPONENT] = stored.length_exponent[pick]
    return WireDraws(
        parameters,
        protocol.length_mm,
        sample.model.law,
        sample.model.history,
        effects,
        (float(readings.min()), float(readings.max())),
        (0.0, float(protocol.duration_s.max())),
        sample.model.tension_ref_N,
    )


def numbers(option: str, text: str, count: int | None = None) -> Any:
    """Finite numbers separated by commas, `count` of them where it is given."""
    import numpy as np

    from wirebayes.errors import InputError

    try:
        values = np.array([float(word) for word in text.split(",")])
    except ValueError:
        values = np.array([np.nan])
    if not np.isfinite(values).all() or (count is not None and len(values) != count):
        raise InputError(f"{option}: found {text!r}; expected {count or 'some'} finite numbers separated by commas")
    return values


def rising_times(text: str) -> Any:
    """Seconds that rise, from `--times`."""
    import numpy as np

    from wirebayes.errors import InputError

    values = numbers("--times", text)
    if values[0] < 0 or np.any(np.diff(values) <= 0):
        raise InputError(f"--times: found {text!r}; expected rising times from 0 on")
    return values
