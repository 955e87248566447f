"""The posterior of one wire written once more, from the equations, for libraries that differentiate.

Nothing of the model is shared with the package but the data, the prior's numbers and the constants of the coordinates.
`xp` is the array library: ``jax.numpy``, ``pytensor.tensor`` or ``numpy``. Holds are padded to the same number of
readings, so that JAX compiles one hold and scans over them; the others get them one after the other.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.inference.coordinates.slack_edge import DECADES
from wirebayes.inference.coordinates.steps import Preload
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import modes
from wirebayes.numeric.distributions import LogitNormal, LogNormal

LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class Data:
    """Holds in order; readings (H, R) padded with mask 0. Every first reading is at time 0."""

    length_mm: float
    resolution_N: float
    displacement_mm: np.ndarray
    duration_s: np.ndarray
    log_time: np.ndarray
    later: np.ndarray
    tension_N: np.ndarray
    mask: np.ndarray
    saturating: bool


def data(problem):
    (sample,) = problem.samples
    p = sample.protocol
    if (p.time_s[p.recorded, 0] != 0.0).any() or (p.duration_s <= 0).any() or not p.mask[p.recorded, 0].all():
        raise ValueError("the benchmark's model wants holds that last, each with its first reading at time 0")
    later = (p.time_s > 0) & p.mask
    return Data(
        p.length_mm,
        sample.resolution,
        p.setting,
        p.duration_s,
        np.log(np.where(later, p.time_s, 1.0)),
        1.0 * later,
        np.where(p.mask, sample.readings[..., 0], 0.0),
        1.0 * p.mask,
        sample.model.history == "saturating",
    )


def loop(xp, step, state, arrays):
    """The state after `step(state, row)` for all rows of some arrays."""
    if xp.__name__ == "jax.numpy":
        import jax

        def body(state, row):
            return step(state, row), None

        return jax.lax.scan(body, tuple(xp.asarray(s, float) for s in state), tuple(xp.asarray(a) for a in arrays))[0]
    for row in zip(*arrays, strict=True):
        state = step(state, row)
    return state


def chain(xp, theta, d):
    """log p(readings | parameters), hold by hold along the staircase."""
    k1, B, U, k2, N, preload, sensor, setting = (
        theta[n] for n in ("k1", "B", "U", "k2", "N", "preload", "sensor_sd", "setting_sd")
    )
    kept = 1.0 if d.saturating else 0.0
    noise, tau = sensor**2 + d.resolution_N**2 / 12.0, setting**2

    def step(state, row):
        creep, mean, var, total = state
        move, log_duration, log_t, later, y, real = row
        stretched, zero = d.length_mm + preload + move, d.length_mm + creep
        first = k1 * (stretched / zero - 1.0)
        taut = first > 0
        safe = xp.where(taut, first, 1.0)
        goal = xp.where(taut, B * xp.exp(U * xp.log(safe)), 0.0)
        slope = U * goal / safe * k1
        gain, gain_s, gain_c = goal - kept * creep, slope / zero, -slope * stretched / zero**2 - kept
        end = -xp.expm1(-k2 * xp.exp(N * log_duration))
        a, c = 1.0 + gain_c * end, gain_s * end
        part = later * -xp.expm1(-k2 * xp.exp(N * log_t))
        now = zero + gain * part
        pull = k1 * (stretched / now - 1.0)
        pulls = xp.where(pull > 0, k1, 0.0) * real
        f_s = pulls * (1.0 / now - stretched / now**2 * gain_s * part)
        f_c = -pulls * stretched / now**2 * (1.0 + gain_c * part)
        r = (y - xp.where(pull > 0, pull, 0.0)) * real - f_c * mean
        # two numbers unknown, setting error and carried creep: integrate out one, then the other
        q, f, g = xp.sum(r * r) / noise, xp.sum(f_s * f_s) / noise, xp.sum(f_c * f_c) / noise
        fr, gr, fg = xp.sum(f_s * r) / noise, xp.sum(f_c * r) / noise, xp.sum(f_s * f_c) / noise
        one = 1.0 + tau * f
        q1, g1, gr1 = q - tau * fr**2 / one, g - tau * fg**2 / one, gr - tau * fg * fr / one
        two = 1.0 + var * g1
        square = q1 - var * gr1**2 / two
        total = total - 0.5 * (square + real.sum() * (xp.log(noise) + LOG_2PI) + xp.log(one) + xp.log(two))
        shift, creep_var = var * gr1 / two, var / two
        set_mean, set_var, lean = tau * (fr - fg * shift) / one, tau / one, -tau * fg / one
        mean = a * (mean + shift) + c * set_mean
        return creep + gain * end, mean, (a + c * lean) ** 2 * creep_var + c**2 * set_var, total

    rows = (d.displacement_mm, np.log(d.duration_s), d.log_time, d.later, d.tension_N, d.mask)
    return loop(xp, step, (0.0, 0.0, 0.0, 0.0), rows)[-1]


def hold(xp, theta, d):
    """log p(later readings | first reading) of every hold by itself."""
    k1, B, U, k2, N, sensor = (theta[n] for n in ("k1", "B", "U", "k2", "N", "sensor_sd"))
    use = np.flatnonzero((d.later.sum(axis=1) > 0) & (d.tension_N[:, 0] > 0))
    y, later, log_t, first = d.tension_N[use], d.later[use], d.log_time[use], d.tension_N[use, :1]
    noise = sensor**2 + d.resolution_N**2 / 12.0
    stretched = d.length_mm * (1.0 + first / k1)
    gain = B * xp.exp(U * np.log(first))
    part = -xp.expm1(-k2 * xp.exp(N * log_t))
    now = d.length_mm + gain * part
    pull = k1 * (stretched / now - 1.0)
    pulls = xp.where(pull > 0, k1, 0.0)
    slope = pulls * (1.0 / now - stretched / now**2 * part * U * gain / first * k1 / d.length_mm)
    ratio = slope * d.length_mm / k1 * later
    r = (y - xp.where(pull > 0, pull, 0.0)) * later
    aa, ar, rr = xp.sum(ratio * ratio, axis=1), xp.sum(ratio * r, axis=1), xp.sum(r * r)
    square = (rr - xp.sum(ar**2 / (1.0 + aa))) / noise
    return -0.5 * (square + later.sum() * (xp.log(noise) + LOG_2PI) + xp.sum(xp.log1p(aa)))


def prior_terms(problem):
    """(name, coordinate, location, scale) of every parameter, normal in itself, its logarithm or log odds.

    A number in place of the coordinate's name is the largest value of a parameter whose log odds are normal.
    """
    out: list[tuple[str, str | float, float, float]] = []
    for name, dist in problem.prior.distributions.items():
        if isinstance(dist, LogNormal):
            out.append((name, "log", float(np.log(dist.middle)), dist.sd_log))
        elif isinstance(dist, LogitNormal):
            out.append((name, dist.most, dist.middle + float(np.log(dist.most)), dist.sd))
        else:
            out.append((name, "itself", float(dist.mean()), float(dist.std())))
    return out


def value_of(xp, coordinate, kind):
    """A parameter by its coordinate, which has a normal prior; `kind` as `prior_terms` has it."""
    if kind == "itself":
        return coordinate
    if kind == "log":
        return xp.exp(coordinate)
    odds = xp.exp(coordinate)
    return odds / (1.0 + odds / kind)


def coordinate_of(value, kind):
    """The inverse of `value_of`, of numpy arrays."""
    if kind == "itself":
        return value
    if kind == "log":
        return np.log(value)
    return np.log(value / (1.0 - value / kind))


def log_likelihood(xp, problem):
    d, function = data(problem), chain if problem.likelihood == "chain" else hold
    return lambda theta: function(xp, theta, d)


def natural(xp, problem, coordinates):
    """A function from our sampled coordinates (a sequence) to named natural parameters and log density of the prior."""
    (ridge,) = coordinates.ridges
    slack_edges = [step.edge for step in coordinates.steps if isinstance(step, Preload)]
    names, terms = problem.names, prior_terms(problem)

    def convert(z):
        v = {name: z[i] * float(coordinates.scale[i]) for i, name in enumerate(names)}  # logarithms have scale 1
        if "U" in ridge.shifted:
            hazards, powers = ridge.powers
            along = xp.clip(v["k2"] - hazards[:-1], 0.0, np.diff(hazards))  # linear between the hazards
            v["U"] = v["U"] + powers[0] + xp.sum(along * (np.diff(powers) / np.diff(hazards)))
        v["k2"] = v["k2"] - xp.exp(v["N"]) * float(np.log(0.5 * ridge.hold_s))
        U, k2, N = xp.exp(v["U"]), xp.exp(v["k2"]), xp.exp(v["N"])
        middle = float(ridge.log_tension.mean())
        # the benchmark's wires are read from the beginning of each hold to its end: all that is lost is seen
        log_t = np.log(ridge.times_s[ridge.which_end])

        def step(state, row):
            carried, square = state
            log_f, log_time = row
            gained = (xp.exp(U * log_f) - ridge.kept * carried) * -xp.expm1(-k2 * xp.exp(N * log_time))
            return carried + gained, square + gained**2

        _, square = loop(xp, step, (0.0, 0.0), (ridge.log_tension - middle, log_t))
        creep = U * middle + 0.5 * xp.log(square / len(ridge.which_end))
        softened = xp.logaddexp(0.0, v["B"] - ridge.log_step) if "k1" in ridge.shifted else 0.0
        v["k1"] = v["k1"] + softened
        v["B"] = v["B"] - creep - v["k1"] + ridge.log_length
        theta = {name: value_of(xp, v[name], coordinate) for name, coordinate, *_ in terms}
        volume = 0.0
        for slack in slack_edges:  # the benchmark's wires have no threshold of creep
            near = (v["preload"] - slack.at) / slack.width
            far = -near - 2.0 * DECADES
            v["preload"] = slack.at + slack.width * (xp.logaddexp(0.0, near) - xp.logaddexp(0.0, far))
            volume = xp.logaddexp(-xp.logaddexp(0.0, -near), -xp.logaddexp(0.0, -far))
            theta["preload"] = v["preload"]
        # the map is triangular: but for the preload its Jacobian in logarithms is one (up to constant scales)
        prior = volume + sum(
            -0.5 * ((v[name] - m) / s) ** 2 - float(np.log(s)) - 0.5 * LOG_2PI for name, _, m, s in terms
        )
        return theta, prior + float(np.log(coordinates.scale).sum())

    return convert


def about_mode(target, seed):
    """20 draws of the normal approximation at the mode, as sampled."""
    rng = np.random.default_rng(seed)
    found = modes(target, rng)
    return found.z[0] + rng.normal(size=(20, len(found.z[0]))) @ np.linalg.cholesky(found.covariance[0]).T


def may_be_slack(problem, seed):
    """Whether, about the mode, a setting error may leave the wire slack as a hold begins, which these models ignore."""
    problem = problem.in_units(problem.own_units)
    target = LogPosterior(problem)
    theta = target.coordinates.to_natural(about_mode(target, seed))
    return problem.linearised(theta, problem.samples[0])[0].edges is not None


def difference(xp, problem, seed):
    """Largest difference from the package's log likelihood and log posterior, over 20 draws about the mode."""
    problem = problem.in_units(problem.own_units)
    target = LogPosterior(problem)
    z = about_mode(target, seed)
    theta = target.coordinates.to_natural(z.copy())
    likelihood, convert = log_likelihood(xp, problem), natural(xp, problem, target.coordinates)
    values = [float(likelihood(dict(zip(problem.names, row, strict=True)))) for row in theta]
    whole = [float(convert(row)[1]) + value for row, value in zip(z, values, strict=True)]
    return max(np.abs(problem.log_likelihood(theta) - values).max(), np.abs(target(z) - whole).max())
