"""The catalogue of effects, one small class each, a module per part of the bench."""

from wirebayes.effects import creep, elastic, event, instrument
from wirebayes.errors import InputError
from wirebayes.wire.effect import Effect, EventEffect

CATALOGUE: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        elastic.Toe,
        elastic.StrainStiffening,
        elastic.FixtureCompliance,
        elastic.ThermalExpansion,
        elastic.LengthDependence,
        creep.PermanentCreep,
        creep.Memory,
        creep.SecondRelaxation,
        creep.SteadyCreep,
        creep.TensionDependentRate,
        creep.Ageing,
        creep.CreepThreshold,
        event.GripSlip,
        event.UnrecordedHold,
        instrument.ReadingDelay,
        instrument.SensorDrift,
        instrument.SensorNonlinearity,
        instrument.ClampTransient,
        instrument.LostMotion,
        instrument.GuideFriction,
    )
}


def named(key: str) -> Effect:
    """The effect of a name, ``grip_slip@7`` for one that belongs to a hold.

    Raises
    ------
    InputError
        If the catalogue has no such effect, or the hold is missing or superfluous.
    """
    name, _, variant = key.partition("@")
    if name not in CATALOGUE:
        raise InputError(f"--effect {key}: no such effect; known are {', '.join(sorted(CATALOGUE))}")
    kind = CATALOGUE[name]
    if issubclass(kind, EventEffect):
        if not variant.isdigit():
            raise InputError(f"--effect {key}: this effect happens at one hold, name it as in {name}@7")
        return kind(hold=int(variant))
    if issubclass(kind, elastic.LengthDependence):
        if variant not in ("k1", "B", "U", "N"):
            raise InputError(f"--effect {key}: name the parameter as in {name}@k1 (one of k1, B, U, N)")
        return kind(which=variant)
    if variant:
        raise InputError(f"--effect {key}: {name} takes no '@'")
    return kind()
