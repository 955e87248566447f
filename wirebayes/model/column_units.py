"""Units of the columns of a problem, and a sample written in other units."""

from collections.abc import Sequence
from dataclasses import replace

from wirebayes.model.sample import Sample
from wirebayes.model.scales import Units
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.effect import Typical

_UNITS = {"k1": "N", "B": "mm", "preload": "mm"}
_ERRORS = {"sensor_sd": READ_UNIT, "setting_sd": SET_UNIT}


def parameter_of(column: str) -> str:
    """The parameter that a column belongs to, whatever its sample or material."""
    return column.split("[")[0]


def unit_of_column(name: str, samples: Sequence[Sample]) -> str:
    """The unit of a column in mm, N and s; of ``B`` and ``k2`` without the part that depends on U and N.

    Parameters
    ----------
    samples : sequence of Sample
        Of the problem: what is set and what is read decides the units of errors and of amplitudes of instruments.
    """
    base, _, mark = name.partition("[")
    if base in _UNITS:
        return _UNITS[base]
    own = mark.rstrip("]")
    here = [s for s in samples if s.name == own] or [s for s in samples if s.protocol.control == own] or samples
    if base in _ERRORS:
        return _ERRORS[base][here[0].protocol.control if here else "displacement"]
    for sample in here:
        for effect in sample.model.effects:
            for column, amplitude in zip(effect.columns(), effect.amplitudes, strict=True):
                if column == base:
                    return effect.unit_under(amplitude, sample.protocol.control)
    return "-"


def units_ratio(unit: str, old: Units, new: Units) -> float:
    """What a number in old units is multiplied by in new ones.

    Parameters
    ----------
    unit : str
        Of the number, made of mm, N and s.
    old, new : Units
    """
    return old.of(unit) / new.of(unit)


def sample_in(sample: Sample, old: Units, new: Units) -> Sample:
    """The same sample in other units.

    Parameters
    ----------
    old, new : Units
        Those it is written in, and those it shall be written in.
    """
    length, tension, time = (units_ratio(unit, old, new) for unit in ("mm", "N", "s"))
    p, model = sample.protocol, sample.model
    set_, read = (units_ratio(units[p.control], old, new) for units in (SET_UNIT, READ_UNIT))
    protocol = replace(
        p,
        length_mm=p.length_mm * length,
        setting=p.setting * set_,
        time_s=p.time_s * time,
        duration_s=p.duration_s * time,
    )
    changed = replace(
        model,
        effects=tuple(effect.in_units(set_, read, time) for effect in model.effects),
        tension_ref_N=model.tension_ref_N * tension,
        length_ref_mm=model.length_ref_mm * length,
        typical=Typical(model.typical.tension_N * tension, model.typical.hold_s * time),
    )
    return replace(
        sample,
        protocol=protocol,
        readings=sample.readings * read,
        resolution=sample.resolution * read,
        model=changed,
    )
