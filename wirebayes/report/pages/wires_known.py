"""Where a page on a robot has its wires from."""

from wirebayes.json_files.pose import WiresUsed
from wirebayes.sentences import counted, listed, spoken


def wires_known(wires: WiresUsed) -> str:
    """What is known of a robot's wires: a posterior, the robot's file, or one for some and the other for the rest."""
    legs = wires["legs"]
    fitted = {*wires["lines"], "default"}  # a leg that names no wire is cut from the only line
    given = [str(leg) for leg, name in enumerate(legs, start=1) if name not in fitted]
    if len(given) == len(legs):
        return "The parameters of every wire are those of the robot's file, not of a posterior."
    model = "the plain model"
    effects = [spoken(effect) for effect in wires["effects"]]
    if effects:
        differ = any(len(models) > 1 for models in wires.get("undecided", {}).values())
        model += f" with some of {listed(effects)}" if differ else f" with {listed(effects)}"
    draws = counted(wires["draws"], "posterior draw")
    length_mm = wires["tested_length_mm"]
    known = f"Wires known from {draws} of a sample of {length_mm:g} mm: {model}."
    if not given:
        return known
    which = f"wire {given[0]}" if len(given) == 1 else f"wires {listed(given)}"
    return f"{known} The parameters of {which} are those of the robot's file."
