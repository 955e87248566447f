"""Inner products of a linearised model in the metric of its noise, whose ratio and scale are integrated out.

The metric is ``V0(ρ) = I + ρ K Kᵀ`` of readings divided by their standard deviation: K is the derivative by the setting
errors, ρ their unknown size relative to the sensor's error. The overall scale of the noise is integrated out and ρ is
summed over a grid, so no test relies on the noise that a possibly wrong model has estimated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wirebayes.discovery.tangent import LARGEST_SLOPE, Tangent, damp, whitened
from wirebayes.numeric.linear_algebra import cholesky
from wirebayes.numeric.typing import Array, Bools, Ints

# of setting to sensor error, squared: from one that does not matter to one beside which the sensor's does not; steps of
# half a decade, as the evidence is smooth in log ρ
RATIOS = np.logspace(-2.0, 6.0, 13)
# δ of the smooth remainder, doubling from about the least that the global test detects; a choice that hardly matters,
# because neighbouring sizes explain nearly the same
SIZES = np.array([4.0, 8.0, 16.0, 32.0])


@dataclass(frozen=True)
class Expansion(Tangent):
    """A tangent with what each effect and the flexible reference would add.

    Attributes
    ----------
    signatures : (n, N, m)
        What each probe adds, per unit amplitude.
    one_sided : (m,) bool
    kinds : (m,) int
        Which effect each is a form of; -1 for what is none.
    flexible : (n, N, q)
        Functions of the flexible reference, one process after the other.
    processes : tuple of int
        How many functions each process has.
    """

    signatures: Array
    one_sided: Array
    kinds: Ints
    flexible: Array
    processes: tuple[int, ...]


@dataclass(frozen=True)
class Projected:
    """Inner products at n parameter sets and k ratios of the grid, free of what the parameters absorb.

    Attributes
    ----------
    shared : (n, k)
        Log volume of setting errors and parameters; -inf where the parameters cannot be distinguished.
    rss : (n, k)
        Of the residual with itself, the prior's square included.
    along, square : (n, k, m)
        Of each signature with the residual and with itself.
    divisor : (n, k, m)
        What `along` is divided by for a signature's best amplitude: its square, or infinity where the parameters take
        all of it but rounding errors, so that the amplitude is zero.
    smooth_along, smooth_square : (n, k, q) and (n, k, q, q) for each process
        Of its smooth functions with the residual and with each other.
    form : Functions
        The signatures, of which `Functions.products` has further products.
    smooth : Functions, for each process
        The same of its smooth functions.
    shrink : (n, k, H)
        How much of what moves whole holds the noise takes at each ratio.
    """

    shared: Array
    rss: Array
    along: Array
    square: Array
    divisor: Array
    smooth_along: list[Array]
    smooth_square: list[Array]
    form: "Functions"
    smooth: list["Functions"]
    shrink: Array


def project(x: Expansion) -> Projected:
    """Project residual, signatures and smooth functions on what the parameters leave, in the metric of each ratio."""
    shrink = damp(x.singular[:, None], RATIOS[:, None])
    log_volume, every = _beside_parameters(x, shrink)
    first_smooth = 1 + x.signatures.shape[2]
    residual = every.between(0, 1)
    form = every.between(1, first_smooth)
    slices = _slices(x.processes, first_smooth)
    smooth = [every.between(own.start, own.stop) for own in slices]
    moved_whole = np.log1p(RATIOS[:, None] * x.singular[:, None] ** 2)
    square = form.squares(shrink)
    alone = (form.plain**2).sum(axis=1)
    is_left = square > ABSORBED * alone[:, None]
    return Projected(
        shared=-0.5 * moved_whole.sum(axis=2) - log_volume,
        rss=residual.squares(shrink)[..., 0] + x.prior_square[:, None],
        along=form.along(residual, shrink),
        square=np.maximum(square, 0.0),
        divisor=np.where(is_left, square, np.inf),
        smooth_along=[process.along(residual, shrink) for process in smooth],
        smooth_square=[process.products(process, shrink) for process in smooth],
        form=form,
        smooth=smooth,
        shrink=shrink,
    )


def _beside_parameters(x: Expansion, shrink: Array) -> tuple[Array, "Functions"]:
    """Log volume (n, k) of the parameters, infinite where they cannot be distinguished, and what they take of columns.

    The columns are the residual, the signatures and the smooth functions.
    """
    p = x.parameters.shape[2]
    residual = x.residual[..., None]
    columns = np.concatenate([x.parameters, residual, x.signatures, x.flexible], axis=2)
    levels = np.swapaxes(x.left, 1, 2) @ columns
    gram = _with_parameters(x, columns, levels, shrink)
    log_volume, taken = _eliminated(gram)
    return log_volume, Functions(columns[..., p:], taken, levels[..., p:])


def _eliminated(gram: Array) -> tuple[Array, Array]:
    """From inner products (n, k, p, c) of p parameters: their log volume, and what they take of the other columns.

    That is in coordinates in which it is a sum of squares.
    """
    p = gram.shape[2]
    factor = cholesky(gram[..., :p])
    regular = np.isfinite(factor).all(axis=(2, 3))
    factor[~regular] = np.eye(p)
    taken = np.linalg.inv(factor) @ gram[..., p:]
    taken[~regular] = 0.0
    diagonal = np.einsum("nkpp->nkp", factor)
    log_volume = np.log(diagonal).sum(axis=2)
    return np.where(regular, log_volume, np.inf), taken


def _with_parameters(x: Expansion, columns: Array, levels: Array, shrink: Array) -> Array:
    """(n, k, p, c) inner products of the parameters with columns (n, N, c), themselves first, and the prior's part."""
    p = x.parameters.shape[2]
    of_parameters = np.swapaxes(levels[..., :p], 1, 2)
    shrunk = of_parameters[:, None] * shrink[:, :, None]
    plain = np.swapaxes(x.parameters, 1, 2) @ columns
    gram = plain[:, None] - shrunk @ levels[:, None]
    gram[..., :p] += x.prior_precision[:, None]
    gram[..., p] += x.prior_gradient[:, None]
    return gram


def with_each_signature(x: Expansion, found: Projected) -> tuple[Array, Array]:
    """(n, k, m) sum of squares that each signature at its best amplitude leaves, and log evidence, at each ratio."""
    upward = np.where(x.one_sided, np.maximum(found.along, 0.0), found.along)
    left = np.maximum(found.rss[..., None] - upward**2 / found.divisor, x.least[:, None, None])
    return left, found.shared[..., None] - 0.5 * x.degrees * np.log(left)


def _slices(processes: Sequence[int], first: int = 0) -> list[slice]:
    """Where the functions of each process stand, from the column `first` on."""
    ends = first + np.cumsum(processes)
    return [slice(last - count, last) for last, count in zip(ends, processes, strict=True)]


class Functions(NamedTuple):
    """Functions (n, N, q), the parameters' part of them (n, k, p, q) and the setting errors' (n, H, q)."""

    plain: Array
    taken: Array
    levels: Array

    def of(self, columns: Ints) -> "Functions":
        """Some of the functions, chosen by a row of numbers (n, q) each."""
        plain = np.take_along_axis(self.plain, columns[:, None], axis=2)
        taken = np.take_along_axis(self.taken, columns[:, None, None], axis=3)
        levels = np.take_along_axis(self.levels, columns[:, None], axis=2)
        return Functions(plain, taken, levels)

    def between(self, first: int, last: int) -> "Functions":
        """The functions from the column `first` to the one before `last`."""
        return Functions(*(part[..., first:last] for part in self))

    def squares(self, shrink: Array) -> Array:
        """(n, k, q) inner product of each with itself."""
        plain = np.einsum("nif,nif->nf", self.plain, self.plain)[:, None]
        taken = np.einsum("nkpf,nkpf->nkf", self.taken, self.taken)
        return plain - shrink @ self.levels**2 - taken

    def along(self, one: "Functions", shrink: Array) -> Array:
        """(n, k, q) inner product of each with a single other function."""
        plain = np.swapaxes(one.plain, 1, 2) @ self.plain
        taken = (np.swapaxes(one.taken, 2, 3) @ self.taken)[:, :, 0]
        return plain - shrink @ (self.levels * one.levels) - taken

    def products(self, other: "Functions", shrink: Array) -> Array:
        """(n, k, q, m) inner products with other functions, as `project` has them."""
        plain = np.swapaxes(self.plain, 1, 2) @ other.plain
        shrunk = np.swapaxes(self.levels, 1, 2)[:, None] * shrink[:, :, None]
        whole_holds = shrunk @ other.levels[:, None]
        taken = np.swapaxes(self.taken, 2, 3) @ other.taken
        return plain[:, None] - taken - whole_holds


def evidences(x: Expansion) -> tuple[Array, Array]:
    """(n, k) and (n, k, s) log evidence at each ratio, without a remainder and with one of each process and size.

    Parameters and the scale of the noise are integrated out; the prior has its top at one. It is -inf for a row that
    has no tangent.
    """
    seen = has_tangent(x)
    x = without_tangent(x)
    plain, beside = without_and_with(x, project(x))
    return np.where(seen[:, None], plain, -np.inf), np.where(seen[:, None, None], beside, -np.inf)


def without_and_with(x: Expansion, found: Projected) -> tuple[Array, Array]:
    """(n, k) and (n, k, s) log evidence as `evidences` has them, of rows that all have a tangent."""
    half = 0.5 * x.degrees
    least = x.least[:, None]
    plain = found.shared - half * np.log(np.maximum(found.rss, least))
    beside = []
    for square, along in zip(found.smooth_square, found.smooth_along, strict=True):
        log_volume, taken = _taken_by(square, along)
        # The process is measured in units of the noise that is left beside it.
        left = np.maximum(found.rss[..., None] - taken, least[..., None])
        beside.append(found.shared[..., None] - log_volume - half * np.log(left))
    return plain, np.concatenate(beside, axis=2)


def _taken_by(square: Array, along: Array) -> tuple[Array, Array]:
    """What a process of each size takes: half a log determinant, and of the sum of squares, both (..., sizes).

    `square` (..., q, q) and `along` (..., q) are the inner products of its functions with themselves and the residual.
    """
    q = along.shape[-1]
    factor = cholesky(_bordered(square, along))
    pivots = np.einsum("...ff->...f", factor)[..., :q]
    with np.errstate(invalid="ignore"):
        log_volume = np.log(pivots).sum(axis=-1)
        less = (factor[..., q, :q] ** 2).sum(axis=-1)
    # Functions that the parameters take entirely leave rounding errors.
    seen = np.isfinite(log_volume + less)
    return np.where(seen, log_volume, 0.0), np.where(seen, less, 0.0)


def _bordered(square: Array, along: Array) -> Array:
    """I + share square for each size, bordered by the residual's products: one Cholesky factor of it holds both.

    The corner is not used.
    """
    q = along.shape[-1]
    whole = np.einsum("...ff->...", square)[..., None]
    share = SIZES**2 / np.maximum(whole, 1e-300)
    out = np.zeros((*share.shape, q + 1, q + 1))
    out[..., :q, :q] = share[..., None, None] * square[..., None, :, :]
    _add_identity(out)
    out[..., q, :q] = np.sqrt(share)[..., None] * along[..., None, :]
    out[..., q, q] = LARGEST_SLOPE
    return out


def _add_identity(matrices: Array) -> None:
    """Add one to all diagonals (..., q, q), in place."""
    q = matrices.shape[-1]
    flat = matrices.reshape(-1, q * q)
    flat[:, :: q + 1] += 1.0


def has_tangent(x: Expansion) -> Bools:
    """(n,) where the model neither overflows nor jumps."""
    parts = (x.parameters, x.signatures, x.flexible, x.residual[..., None])
    with np.errstate(invalid="ignore"):
        return np.all([(np.abs(part) < LARGEST_SLOPE).all(axis=(1, 2)) for part in parts], axis=0)


def without_tangent(x: Expansion) -> Expansion:
    """Rows that have no tangent as rows in which nothing is seen."""
    seen = has_tangent(x)
    if seen.all():
        return x
    names = ("parameters", "signatures", "flexible")
    parts: dict[str, Any] = {name: np.where(seen[:, None, None], getattr(x, name), 0.0) for name in names}
    return replace(x, **parts, residual=np.where(seen[:, None], x.residual, 0.0))


def projected(x: Expansion, ratio: float) -> Array:
    """(N, m) signatures of the first row, whitened at a noise ratio, free of what the parameters absorb."""
    basis, _ = np.linalg.qr(whitened(x, x.parameters[0], ratio))
    signatures = whitened(x, x.signatures[0], ratio)
    return signatures - basis @ (basis.T @ signatures)


# Squared share of a signature below which the parameters take all of it. Under weights a toe is a shift, which the
# preload takes, and a bend: read often and finely, a bend of a millionth is seen well. Rounding leaves 1e-12.
ABSORBED = 1e-8
