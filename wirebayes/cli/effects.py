"""``wirebayes effects``: the catalogue, for people."""

from typing import Annotated

import typer

from wirebayes.cli.options import OwnEffects

Name = Annotated[str | None, typer.Argument(metavar="[NAME]", help="Describe this effect only.")]


def effects_command(name: Name = None, own_effects: OwnEffects = None) -> None:
    """List the effects that a model may be missing; with NAME, describe one in full."""
    from wirebayes.commands.list_effects import list_effects
    from wirebayes.effects import catalogue, effect_named

    known = list_effects(own_effects)
    if name is None:
        width = max(len(e.name) for e in known)
        for e in known:
            typer.echo(f"{e.name:{width}}  {e.scope:11}  {e.meaning}")
        return
    wanted = effect_named(name, catalogue(own_effects)).name  # an unknown name is refused, with those that there are
    (effect,) = [e for e in known if e.name == wanted]
    lines = [
        effect.name,
        f"  formula    {effect.formula}",
        f"  meaning    {effect.meaning}",
        f"  belongs to {effect.scope}",
        f"  shows as   {effect.shows}",
    ]
    for a in effect.amplitudes:
        neutral = "" if a.is_shape else f", neutral value {a.neutral:g}"
        lines.append(f"  parameter  {effect.name}.{a.name} in {'1' if a.unit == '-' else a.unit}{neutral}")
    typer.echo("\n".join(lines))
