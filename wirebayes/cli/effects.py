"""``wirebayes effects``: the catalogue, for people."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wirebayes.cli.options import OwnEffects, Seed

if TYPE_CHECKING:
    from wirebayes.commands.list_effects import EffectDescription

Name = Annotated[str | None, typer.Argument(metavar="[NAME]", help="Describe this effect only.")]
Kept = Annotated[
    Path | None, typer.Option("--output", metavar="DIR", help="Folder for effects.txt, which holds the same text.")
]


def effects_command(name: Name = None, output: Kept = None, seed: Seed = 0, own_effects: OwnEffects = None) -> None:
    """List the effects that a model may be missing; with NAME, describe one in full."""
    from wirebayes.commands.list_effects import list_effects
    from wirebayes.effects import catalogue, effect_named
    from wirebayes.io.run_folder import writable, write_text

    known = list_effects(own_effects)
    if name is None:
        lines = _listed(known)
    else:
        by_name = {effect.name: effect for effect in known}
        # an effect of one hold, or of one parameter, has its name in the list; an unknown name is refused
        wanted = name if name in by_name else effect_named(name, catalogue(own_effects)).name
        lines = _described(by_name[wanted])
    text = "\n".join(lines)
    if output is not None:
        with writable(output):
            output.mkdir(parents=True, exist_ok=True)
            write_text(output / "effects.txt", f"{text}\n")
    typer.echo(text)


def _listed(known: "Sequence[EffectDescription]") -> list[str]:
    width = max(len(e.name) for e in known)
    return [f"{e.name:{width}}  {e.scope:11}  {e.meaning}" for e in known]


def _described(effect: "EffectDescription") -> list[str]:
    lines = [
        effect.name,
        f"  formula    {effect.formula}",
        f"  meaning    {effect.meaning}",
        f"  belongs to {effect.scope}",
        f"  shows as   {effect.shows}",
    ]
    if effect.meaning_of_weights != effect.meaning:
        lines.append(f"  weights    {effect.meaning_of_weights}")
    for a in effect.amplitudes:
        neutral = "" if a.is_shape else f", neutral value {a.neutral:g}"
        lines.append(f"  parameter  {effect.name}.{a.name} in {'1' if a.unit == '-' else a.unit}{neutral}")
    return lines
