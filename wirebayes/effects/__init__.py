"""The catalogue of effects, one small class each, a module per part of the bench."""

import importlib.util
import os
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import get_args

from wirebayes.effects import creep, elastic, event, instrument, unknown
from wirebayes.errors import InputError
from wirebayes.wire.effect import Effect, EventEffect, Kinds
from wirebayes.wire.protocol import Control

CONTROLS = get_args(Control)

CATALOGUE: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        elastic.Toe,
        elastic.StrainStiffening,
        elastic.PowerStrain,
        elastic.FixtureCompliance,
        elastic.ThermalExpansion,
        elastic.LengthDependence,
        creep.PermanentCreep,
        creep.Superposition,
        creep.PriorCreep,
        creep.SecondRelaxation,
        creep.SteadyCreep,
        creep.TensionDependentRate,
        creep.Ageing,
        creep.CreepThreshold,
        event.GripSlip,
        event.UnrecordedHold,
        instrument.ReadingDelay,
        instrument.LateClock,
        instrument.SensorDrift,
        instrument.SensorNonlinearity,
        instrument.ClampTransient,
        instrument.ScrewError,
        instrument.LostMotion,
        instrument.GuideFriction,
    )
}


def catalogue(own: Path | None = None) -> dict[str, type[Effect]]:
    """The effects by name, with those of a user's own Python file behind them.

    Raises
    ------
    InputError
        If the file cannot be run, holds no effect, or one of them lacks what `Effect` requires.
    """
    if own is None:
        return CATALOGUE
    effects = {}
    for effect in _effects_in(own):
        needed = ("name", "place", "scope", "amplitudes", "sentence")
        lacking = [attribute for attribute in needed if not hasattr(effect, attribute)]
        if lacking:
            found = f"the effect {effect.__name__} that lacks {', '.join(lacking)}"
            raise InputError(f"{own}: found {found}, expected all of them")
        if effect.name in CATALOGUE:
            taken = f"the effect {effect.__name__} with the name {effect.name} of the catalogue"
            raise InputError(f"{own}: found {taken}, expected another name")
        effects[effect.name] = effect
    if not effects:
        raise InputError(f"{own}: found no effect in it, expected a class derived from wirebayes.wire.effect.Effect")
    return CATALOGUE | effects


def _effects_in(own: Path) -> list[type[Effect]]:
    """The classes of effects that a file defines, which is run for it."""
    if not os.path.isfile(own):
        raise InputError(f"{own}: found no such file, expected a Python file with effects")
    if own.suffix != ".py":
        raise InputError(f"{own}: found no Python file by its name, expected one that ends in .py")
    try:
        module = _run(own.resolve(), own.read_bytes())
    except (Exception, SystemExit) as error:  # whatever the user's file raises is reported in one line
        raised = f"{type(error).__name__}: {error}"
        raise InputError(f"{own}: cannot be run ({raised}), expected a Python file with effects") from None
    sys.modules[module.__name__] = module  # so that other processes can be sent its effects
    classes = [value for value in vars(module).values() if isinstance(value, type) and issubclass(value, Effect)]
    return [kind for kind in classes if kind.__module__ == module.__name__]  # not those that the file imports


@cache
def _run(own: Path, _content: bytes) -> ModuleType:
    """The module of a user's file: run once for each content, for two runs make classes that are not the same.

    An effect of one could not be sent to a process while the other stands under the module's name.
    """
    spec = importlib.util.spec_from_file_location(f"wirebayes_own_{own.stem}", own)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def source_of(own: Path | None) -> str | None:
    """The text of a user's file of effects, whatever its encoding, for the configuration it belongs to."""
    return None if own is None else own.read_text(encoding="utf-8", errors="backslashreplace")


def effect_named(key: str, known: Kinds = CATALOGUE) -> Effect:
    """The effect of a key: a name, ``grip_slip@7`` (or ``grip_slip@EXPERIMENT:7``) for one that belongs to a hold.

    Raises
    ------
    InputError
        If there is no such effect, or the hold is missing or superfluous.
    """
    name, _, variant = key.partition("@")
    if name == unknown.Discrepancy.name:
        return unknown.parsed(variant)
    if name not in known:
        raise InputError(f"effect {key}: no such effect; known are {', '.join(sorted(known))}")
    kind = known[name]
    if issubclass(kind, EventEffect):
        test, _, hold = variant.rpartition(":")
        if not hold.isdigit():
            raise InputError(
                f"effect {key}: this effect happens at one hold, name it as in {name}@7 or {name}@EXPERIMENT:7"
            )
        return kind(hold=int(hold), test=test)
    if issubclass(kind, elastic.LengthDependence):
        if variant not in ("k1", "B", "U", "N"):
            raise InputError(f"effect {key}: name the parameter as in {name}@k1 (one of k1, B, U, N)")
        return kind(which=variant)
    for form in (creep.SteadyCreepCarried(), elastic.ToeOfStrain()):
        if key == form.key:
            return form
    if variant in CONTROLS and kind.scope != "material":
        return kind().under(variant)  # type: ignore[arg-type]
    if variant:
        raise InputError(f"effect {key}: {name} takes no '@'")
    return kind()
