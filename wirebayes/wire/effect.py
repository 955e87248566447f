"""The interface of an effect: a change of one quantity at one named place of the model.

The staircase calls effects by place and knows none by name; a user's own effect is a subclass in the user's file.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.laws import ElasticLaw
from wirebayes.wire.protocol import Control, Protocol

Place = Literal[
    "sample",  # the dictionary of parameters itself, before anything is computed
    "position",  # stretched length, mm: of the wire by that of the screw, or of the gauge by that of the wire
    "zero_length",  # zero-tension length, creep included, mm
    "strain",  # strain whose product with k1 is the tension
    "time",  # time of every reading since the hold began, s
    "before",  # time passed at displacement zero before the first hold, s
    "wait",  # time passed at this displacement before the hold began, s
    "drive",  # tension that drives the creep, N
    "amount",  # creep still to come in this hold, mm
    "rate",  # k2, s^-N
    "clock",  # time since the hold began, s
    "fraction",  # share of the amount reached by a time
    "creep",  # carried creep elongation over the hold, mm
    "elongation",  # an elongation beside the creep: carried-in value in, values over the hold out, mm
    "guide",  # tension beyond the guide, at the sensor or at the weight, N
    "reading",  # what the sensor says, N, or the gauge where the tension is set, mm
]
Scope = Literal["material", "instrument", "environment", "event"]
OF_THE_BENCH = (
    "position",
    "time",
    "before",
    "wait",
    "guide",
    "reading",
)  # places that a wire away from the bench does not have


@dataclass(frozen=True)
class Amplitude:
    """One parameter of an effect.

    Attributes
    ----------
    name, unit : str
    neutral : float
        The value at which the effect returns the plain model to the last bit.
    prior : Distribution, or a frozen distribution of scipy
        In the test's own units: displacement steps for mm, typical tensions for N, typical holds for s.
    is_shape : bool
        True for a positive constant of the form (a time constant), sampled as a logarithm; it means nothing while
        the amplitude is neutral.
    is_elongation : bool
        True where the amplitude is an elongation of the whole wire, which grows with the length of the sample.
    in_natural_units : bool
        True where the prior was learned from the readings, and is in the amplitude's own unit.
    of_each_test : bool
        True where every test has its own, whatever its effect shares.
    """

    name: str
    unit: str
    neutral: float
    prior: Any
    is_shape: bool = False
    is_elongation: bool = False
    in_natural_units: bool = False
    of_each_test: bool = False


class Typical(NamedTuple):
    """What is typical of the tests of a fit, in N and s; in a robot a value a leg, (w, 1), where lines differ.

    Effects refer to it where a number would depend on what is called a newton or a second.
    """

    tension_N: Any = 1.0
    hold_s: Any = 1.0


ONE_NEWTON_AND_SECOND = Typical()  # of a wire whose parameters are not known from tests


Own = dict[str, Array]  # an effect's own amplitudes, by name
Clock = tuple[Any, Array, Array]  # when it began, the creep that it heads for, its rate


@dataclass
class HoldContext:
    """What an effect may look at while one hold is computed; arrays end in the batch axis ``n``.

    Attributes
    ----------
    index : int
        Position among all holds, unrecorded ones included, from 0.
    recorded : bool
        False for a hold of which no reading was kept.
    order : float
        The hold's number; an unrecorded hold lies half a number below the one it precedes.
    setting : float
        What is set in this hold: the displacement, mm, or the tension, N.
    displacement_mm : float or (R, n) array
        Of this hold; where the tension is set, what follows from it, once that is known.
    direction, first_direction : int
        Sign of the last change of what is set, and of the first one of the test.
    start_s, duration_s : float
        Elapsed time when the hold begins; how long it lasts.
    time_s : (R, 1) array
    warming_K : (R, 1) array
        Zero where no temperature was logged.
    length_mm, length_ref_mm, tension_ref_N : float
    typical : Typical
        Tension and hold of the tests of the fit.
    theta : dict of (n,) arrays
        All parameters of the model.
    initial_tension : (1, n) array
        Tension when the hold begins.
    carried : (1, n) array
        Creep elongation carried into the hold.
    zero_mm : (R, n) array
        Zero-tension length at the times of the hold, for effects on the strain.
    grown : (R, n) array
        Creep elongation at the times of the hold, for effects beside it.
    past : list of (start_s, goal, k2)
        The clocks of the holds so far, this one's last: when each began, the creep it heads for, mm, and its rate.
    law : {"hooke", "modified"}
        Which strain it is that effects on it change.
    """

    index: int
    recorded: bool
    order: float
    setting: float
    displacement_mm: Any
    direction: int
    first_direction: int
    start_s: float
    duration_s: float
    time_s: Array
    warming_K: Array
    length_mm: float
    length_ref_mm: float
    tension_ref_N: float
    theta: dict[str, Array]
    initial_tension: Array = field(default_factory=lambda: np.zeros((1, 1)))
    carried: Array = field(default_factory=lambda: np.zeros((1, 1)))
    zero_mm: Array = field(default_factory=lambda: np.zeros((1, 1)))
    grown: Array = field(default_factory=lambda: np.zeros((1, 1)))
    past: list[Clock] = field(default_factory=list)
    law: ElasticLaw = "hooke"
    typical: Typical = ONE_NEWTON_AND_SECOND

    def carrying(self, carried: Array) -> "HoldContext":
        """The same hold with other creep carried into it, (1, n)."""
        # coordinates need one for every hold of a batch, and `replace` takes three times as long
        return HoldContext(**vars(self) | {"carried": carried})


class Effect:
    """Base of every effect: name, place, scope, amplitudes and one function of one value.

    A subclass sets the class attributes and writes `apply`; that is all the rest of the toolkit needs.
    Functions must accept complex values (derivatives are taken by a complex step): compare ``value.real``.
    """

    name: ClassVar[str]
    place: ClassVar[Place]
    scope: ClassVar[Scope]
    amplitudes: ClassVar[tuple[Amplitude, ...]]
    sentence: ClassVar[str]
    sentence_of_weights: ClassVar[str] = ""  # where weights are set, if another: the gauge is read, not the sensor
    shows: ClassVar[str] = ""
    pattern: ClassVar[str] = ""  # what it has in common with others that look like it: a key of `families.PATTERNS`
    adds: ClassVar[bool] = False  # a sum to the reading, of each amplitude times a function of hold and time alone
    formula: ClassVar[str] = ""  # the name of its compiled twin in `wirebayes/wire/_kernel.pyx`, where it has one
    no_creep_below: ClassVar[str] = ""  # the parameter that is a tension below which nothing creeps, where it has one
    straightens: ClassVar[str] = ""  # the parameter that is a length which pulls only once straight, where it has one
    in_series: ClassVar[bool] = False  # its amplitude is a compliance in series with the wire
    compares_lengths: ClassVar[bool] = False  # changes parameters by the sample's length over the common one
    nearly_linear: ClassVar[bool] = False  # of one sign, yet its signature has the same form at any size
    needs_saturation: ClassVar[bool] = False  # has no meaning where creep is added anew in every hold
    control: Control | None = None  # of the tests that it acts on, where it does not act on all: see `under`

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        """The quantity at the effect's place, changed by the effect.

        Parameters
        ----------
        value : array
            The quantity before this effect, in the unit of its `Place`. Its last axis is the batch ``n`` (or one, where
            all draws share the value); the axis before it, where there is one, runs over the times of the hold. It may
            be complex, because derivatives are taken by a complex step: compare ``value.real`` and let the imaginary
            part through. At ``sample`` it is the dictionary of all parameters.
        own : dict of name to (n,) array
            The effect's amplitudes by their short names (``own["p"]``, not ``own["my_effect.p"]``).
        hold : HoldContext
            The hold that is being computed and what came before it; not to be changed.

        Returns
        -------
        array
            A new one, of a shape that broadcasts with `value`. Where the amplitudes are neutral it equals `value` to
            the last bit. At ``elongation`` the value is what was carried into the hold, and what is returned is the
            course over its times.
        """
        raise NotImplementedError

    @property
    def key(self) -> str:
        """The effect's name, with its hold where it has one, or the only kind of tests that it acts on."""
        return self.name if self.control is None else f"{self.name}@{self.control}"

    @property
    def has_formula(self) -> bool:
        """Whether the compiled twin computes it: a subclass with an `apply` of its own has lost that of its parent."""
        kinds = [vars(kind) for kind in type(self).__mro__]
        applied = next(place for place, own in enumerate(kinds) if "apply" in own)
        stated = next(place for place, own in enumerate(kinds) if "formula" in own)
        return bool(self.formula) and stated <= applied

    def formula_constant(self, typical: Typical) -> float:
        """A number that the compiled twin refers to beside the amplitudes, such as the hold of an event.

        Parameters
        ----------
        typical : Typical
            Of the model.
        """
        return 0.0

    def columns(self) -> tuple[str, ...]:
        """Parameter names as they appear in a posterior: ``effect_name.parameter``."""
        return tuple(f"{self.name}.{a.name}" for a in self.amplitudes)

    @property
    def amplitude_column(self) -> str:
        """The first of its columns: how strong the effect is."""
        return self.columns()[0]

    @property
    def shape_columns(self) -> tuple[str, ...]:
        """Its other columns: what else there is to know of the effect."""
        return self.columns()[1:]

    def common_shapes(self) -> tuple[str, ...]:
        """Columns of the shape constants that all tests have alike."""
        shapes = zip(self.columns(), self.amplitudes, strict=True)
        return tuple(column for column, a in shapes if a.is_shape and not a.of_each_test)

    def under(self, control: Control | None) -> Self:
        """The effect on tests of one control alone, as of an instrument that reads these; on all tests for None."""
        own = copy(self)
        object.__setattr__(own, "control", control)  # some effects are frozen
        return own

    def acts_on(self, test: str, control: Control) -> bool:
        """Whether the effect is there in a test.

        Parameters
        ----------
        test : str
            The experiment's name.
        control : {"displacement", "force"}
            What is set in it.
        """
        return self.control in (None, control)

    def in_units(self, set_: float, read: float, time: float) -> "Effect":
        """The effect where numbers are multiplied by these; itself unless it has such constants.

        Parameters
        ----------
        set_, read, time : float
            Factors of what is set in a hold, of what is read, and of times.
        """
        return self

    def referred(self, hold_s: float) -> "Effect":
        """The effect for a test whose holds typically last so long; itself unless its form refers to that."""
        return self

    @classmethod
    def sentence_under(cls, control: Control) -> str:
        """What the effect says of the wire or the bench.

        Parameters
        ----------
        control : {"displacement", "force"}
        """
        return (control == "force" and cls.sentence_of_weights) or cls.sentence

    @classmethod
    def unit_under(cls, amplitude: Amplitude, control: Control) -> str:
        """Unit of an amplitude: what is added to a reading is in mm where the displacement is read.

        Parameters
        ----------
        control : {"displacement", "force"}
        """
        swapped = control == "force" and cls.place == "reading"
        return amplitude.unit.replace("N", "mm") if swapped else amplitude.unit

    def on(self, protocols: Sequence[Protocol], range_mm: float) -> "Effect":
        """The effect with the priors that it has for some tests, stretched so far; itself unless they depend on it."""
        return self

    def shapes_tried(self) -> list[dict[str, float]]:
        """Values of its shape constants, by column, at which an effect is looked for: quantiles of each."""
        tried: list[dict[str, float]] = [{}]
        for name, shape in zip(self.shape_columns, self.amplitudes[1:], strict=True):
            tried = [known | {name: float(v)} for known in tried for v in shape.prior.ppf([0.1, 0.5, 0.9])]
        return tried

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list["Effect"]:
        """The forms of this effect that a set of tests could show; empty where it could show none.

        Most effects have one form; one that happened at a single hold has one a hold.
        """
        return [cls()]


class Placed:
    """The effects of a model by place, each with its own amplitudes.

    Parameters
    ----------
    effects : sequence of Effect
        Those at one place compose in this order.
    theta : mapping of name to array
        Holds ``effect_name.parameter`` of every effect.

    Attributes
    ----------
    at : dict of place to list of Effect
        Only places that have an effect.
    own : dict of effect key to its amplitudes by their short names
    """

    def __init__(self, effects: Sequence[Effect], theta: Mapping[str, Array]) -> None:
        self.at: dict[str, list[Effect]] = {}
        for effect in effects:
            self.at.setdefault(effect.place, []).append(effect)
        self.own = {e.key: {a.name: theta[c] for a, c in zip(e.amplitudes, e.columns(), strict=True)} for e in effects}

    def change(self, place: Place, value: Any, hold: HoldContext) -> Any:
        """A quantity after all effects at its place.

        Parameters
        ----------
        value : array, or dict at ``sample``
            The quantity as the plain model has it.

        Returns
        -------
        array, or dict at ``sample``
            `value` itself where no effect is at the place.
        """
        for effect in self.at.get(place, ()):
            value = effect.apply(value, self.own[effect.key], hold)
        return value


@dataclass(frozen=True)
class EventEffect(Effect):
    """An effect that happened once, when hold number `hold` began, in the experiment `test` (empty: the only one)."""

    hold: int = 0
    test: str = ""
    scope: ClassVar[Scope] = "event"

    @property
    def key(self) -> str:
        return f"{self.name}@{self.test}:{self.hold}" if self.test else f"{self.name}@{self.hold}"

    def formula_constant(self, typical: Typical) -> float:
        return float(self.hold)

    def acts_on(self, test: str, control: Control) -> bool:
        return self.test in ("", test)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        """One a recorded hold; the protocols are those of one experiment."""
        return [cls(hold=int(number)) for p in protocols for number in p.number[p.recorded]]


Kinds = Mapping[str, type[Effect]]  # effects by name
