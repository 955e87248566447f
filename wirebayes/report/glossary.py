"""What the words, symbols and effects on a page mean, for a reader who has nothing else at hand."""

import inspect
from collections.abc import Iterable, Mapping

from wirebayes.effects import CATALOGUE
from wirebayes.effects.unknown import Discrepancy
from wirebayes.report.blocks import Block, Definitions, Section, Text, unit_text
from wirebayes.results.parameters import unit_of
from wirebayes.sentences import spoken
from wirebayes.wire.effect import Amplitude, Effect

SYMBOLS = {
    "k1": "stiffness: the tension per unit of strain",
    "B": "creep amount: the final creep elongation of this sample under 1 N",
    "U": "how the creep amount grows with the tension; 1 is in proportion",
    "k2": "creep rate; with N = 1 its inverse is the time after which 63 % of the creep has happened",
    "N": "shape of the creep in time; 1 is an exponential, below 1 it begins faster and lasts longer",
    "preload": "stretch that the wire already had at displacement zero",
    "sensor_sd": "standard deviation of the error of one reading: of a tension, or of a displacement under weights",
    "setting_sd": "standard deviation of the error of what one hold is set to: a displacement, or a weight",
}
TERMS = {
    "hold": "one displacement, or one weight, kept while readings are taken.",
    "90 % interval": "the quantity lies in it with a probability of 90 %, given the readings, the prior and the model.",
    "prior": "what was assumed about a parameter before any reading of this test.",
    "contraction": "share of the prior's variance that the readings took away; for a positive parameter, the variance "
    "of its logarithm. At 0 % nothing was learned, from 90 % on the readings determine the parameter.",
    "held out": "readings kept from the model while it was fitted, then predicted: an honest test of it.",
    "rms": "root mean square of measured minus predicted readings: a typical error of one reading.",
    "elpd": "expected log predictive density: how well left-out holds are predicted, larger is better. A difference "
    "of less than 4, or of less than twice its standard error, decides nothing.",
    "in the 90 % band": "share of the held-out readings that lie in their 90 % band; 90 % is right, far less means "
    "that the model is too sure.",
    "p": "probability of a misfit at least this large if nothing were missing in the model.",
    "gap closed": "share of the plain model's error above the noise that the final model takes away, held out.",
    "specimen spread": "how much wires cut from one line differ in stiffness and creep, as a standard deviation.",
    "drift": "how far the platform moves from its pose while the actuators stand still and the wires creep.",
    "controller": "what a robot does about creep: nothing, or lengths corrected by a model of it.",
    "tilt": "angle between the platform's normal and where it should point.",
    "exit point": "where a wire leaves the frame towards the platform.",
    "zero-tension length": "length of a wire without tension, creep so far included.",
    "information": "how much a test narrows all parameters together; one bit halves the volume of what is possible.",
    "δ": "size of an effect in standard deviations of what the other parameters cannot imitate; one of 4 to 5 "
    "is seen in four tests of five.",
    "robust z": "distance from the material's median in units of the spread of its other specimens.",
    "weight": "share of a model in the mixture that predicts left-out holds best.",
}
_LAWS = (
    """<math display="block"><mi>τ</mi><mo>=</mo><msub><mi>k</mi><mn>1</mn></msub><mfrac><mrow><mi>S</mi><mo>−</mo>
<mi>ℓ</mi><mo stretchy="false">(</mo><mi>t</mi><mo stretchy="false">)</mo></mrow><mrow><mi>ℓ</mi>
<mo stretchy="false">(</mo><mi>t</mi><mo stretchy="false">)</mo></mrow></mfrac></math>""",
    """<math display="block">
<mi>ℓ</mi><mo stretchy="false">(</mo><mi>t</mi><mo stretchy="false">)</mo><mo>=</mo><msub><mi>ℓ</mi><mi>0</mi></msub>
<mo>+</mo><mo stretchy="false">(</mo><mi>B</mi><msup><msub><mi>τ</mi><mn>0</mn></msub><mi>U</mi></msup><mo>−</mo>
<mi>e</mi><mo stretchy="false">)</mo><mo stretchy="false">(</mo><mn>1</mn><mo>−</mo><mi>exp</mi>
<mo stretchy="false">(</mo><mo>−</mo><msub><mi>k</mi><mn>2</mn></msub><msup><mi>t</mi><mi>N</mi></msup>
<mo stretchy="false">)</mo><mo stretchy="false">)</mo></math>""",
)
_IN_WORDS = (
    "The model: the tension τ follows the strain between the stretched length S and the zero-tension length ℓ, and is "
    "zero when slack. ℓ grows by creep towards the amount that the tension τ₀ at the beginning of the hold leads to; e "
    "is the creep carried in from earlier holds (0 where histories add up), ℓ₀ the zero-tension length when the hold "
    "begins, t the time since."
)


def meaning(
    terms: Iterable[str] = (),
    effects: Iterable[str] = (),
    own: Mapping[str, Effect] | None = None,
    model: bool = True,
    symbols: bool = True,
) -> Section:
    """The folded section that ends a page: the model, its symbols, the effects named on the page and other terms.

    Parameters
    ----------
    terms : iterable of str
        Keys of `TERMS`.
    effects : iterable of str
        Names of effects, with or without a hold or an amplitude; unknown ones are left out.
    own : mapping of name to Effect, optional
        Effects that the catalogue does not have.
    model : bool
        Explain the model's equation.
    symbols : bool
        And its symbols, which a table of parameters on the page may have explained.
    """
    blocks: list[Block] = []
    if model:
        blocks += [Text(_IN_WORDS), Definitions("Symbols", _symbols() if symbols else [], _LAWS)]
    named = _effects_named(effects, own or {})
    if named:
        blocks.append(Definitions("Effects named here", named))
    defined = [(term, TERMS[term]) for term in terms]
    if defined:
        blocks.append(Definitions("Other words", defined))
    return Section("What the words and symbols mean", blocks, folded=True)


def _symbols() -> list[tuple[str, str]]:
    """The model's symbols with their units, and what each is."""
    return [(f"{name}{_unit(unit_of(name))}", f"{sentence}.") for name, sentence in SYMBOLS.items()]


def _effects_named(effects: Iterable[str], own: Mapping[str, Effect]) -> list[tuple[str, str]]:
    """The effects by their spoken names, each once, and what each is."""
    users = {name: type(effect) for name, effect in own.items()}
    known = {**CATALOGUE, Discrepancy.name: Discrepancy, **users}
    named = []
    for name in dict.fromkeys(_kind_of(effect) for effect in effects):
        if name in known:
            named.append((spoken(name), _effect(known[name])))
    return named


def _kind_of(effect: str) -> str:
    """The name of an effect without its hold or amplitude."""
    return effect.split("@")[0].split(".")[0]


def _effect(kind: type[Effect]) -> str:
    """One line: what it says of the wire, and its amplitudes with their units."""
    formula = inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0]
    formula = formula.replace("\n", " ").replace("->", "→").rstrip(".")
    text = f"{kind.sentence} {formula}."
    if kind.sentence_of_weights:
        text += f" Under weights: {kind.sentence_of_weights}"
    sizes = ", ".join(f"{amplitude.name}{_units(kind, amplitude)}" for amplitude in kind.amplitudes)
    return f"{text} Size: {sizes}." if sizes else text


def _units(kind: type[Effect], amplitude: Amplitude) -> str:
    """Its unit in brackets, and that under weights where it is another."""
    unit, weighed = (kind.unit_under(amplitude, control) for control in ("displacement", "force"))
    return _unit(unit) if unit == weighed else f" ({unit_text(unit)}; under weights {unit_text(weighed)})"


def _unit(unit: str) -> str:
    text = unit_text(unit)
    return f" ({text})" if text else ""
