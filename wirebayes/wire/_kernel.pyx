# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""The staircase and its filter, compiled: one parameter set after the other, derivatives by forward differentiation.

The twin of `wirebayes.wire.staircase` and of `wirebayes.model.likelihoods`, which the tests compare it with; they remain
the reference, and compute what has no formula here. `wirebayes.wire.compiled` decides who computes.
"""

from libc.math cimport INFINITY, NAN, cos, erfc, exp, expm1, fabs, fmax, isinf, isnan, log, log1p, pow, sin, sqrt

import numpy as np

cdef enum:
    _MOST_EFFECTS = 32

MOST_EFFECTS = _MOST_EFFECTS

# In the order of `FORMULAS`; laws of time come last. A new formula also joins the list of its place in `Law`, and has its
# own branch where that list is gone through.
cdef enum Formula:
    STIFFENING, TOE, TOE_OF_STRAIN, POWER, SERIES, THERMAL, K1_OF_LENGTH, B_OF_LENGTH, U_OF_LENGTH, N_OF_LENGTH
    PERMANENT, SUPERPOSITION, SECOND_MODE, FLOW, FLOW_CARRIED, RATE_POWER, AGEING, THRESHOLD, SLIP, BEFORE, WAIT, LATE
    DELAY, DRIFT, SQUARE, TRANSIENT, SCREW, LOST_MOTION, FRICTION
    AT_ONCE, NOT_IN_TIME, LOGARITHMIC, POWER_OF_TIME, TWO_MODES

FORMULAS = (
    "stiffening", "toe", "toe_of_strain", "power", "series", "thermal", "k1_of_length", "B_of_length", "U_of_length",
    "N_of_length", "permanent", "superposition", "second_mode", "flow", "flow_carried", "rate_power", "ageing",
    "threshold", "slip", "before", "wait", "late", "delay", "drift", "square", "transient", "screw", "lost_motion",
    "friction", "at_once", "not_in_time", "logarithmic", "power_of_time", "two_modes",
)

cdef double LEAST_RATE_RATIO = 0.01  # of tension to reference, as in `wirebayes.effects.creep`
cdef double PI = 3.141592653589793
cdef double HALF_LOG_2PI = 0.5 * log(2.0 * PI)
cdef int NEWTON_STEPS = 7  # as in `wirebayes.effects.rivals`
cdef int MOST_STEPS = 200  # as in `wirebayes.wire.inverse`
cdef double EXACT = 4.0 * 2.220446049250313e-16
cdef double MISSED = 1e-9
cdef double FAR = 8.0  # as in `wirebayes.wire.edges`
cdef double LEAST_STRETCH = 0.5  # likewise
cdef double LEAST_READ = 0.1  # likewise
cdef double MOST_ERROR = 6.0  # likewise
cdef double LEAST_VARIANCE = 1e-300  # as in `wirebayes.model.slack_holds`
cdef double LOWEST = -35.0  # standard deviations: below, the complementary error function is next to nothing


cdef struct Dual:
    # A value with its derivatives by the setting error of the hold and by the creep carried into it.
    double v
    double s
    double c


cdef inline Dual constant(double v) noexcept nogil:
    return Dual(v, 0.0, 0.0)


cdef inline Dual plus(Dual x, Dual y) noexcept nogil:
    return Dual(x.v + y.v, x.s + y.s, x.c + y.c)


cdef inline Dual times(Dual x, double a) noexcept nogil:
    return Dual(x.v * a, x.s * a, x.c * a)


cdef inline Dual product(Dual x, Dual y) noexcept nogil:
    return Dual(x.v * y.v, x.s * y.v + x.v * y.s, x.c * y.v + x.v * y.c)


cdef inline Dual minus(Dual x, Dual y) noexcept nogil:
    return Dual(x.v - y.v, x.s - y.s, x.c - y.c)


cdef inline Dual quotient(Dual x, Dual y) noexcept nogil:
    cdef double inverse = 1.0 / y.v, out = x.v * inverse
    return Dual(out, (x.s - out * y.s) * inverse, (x.c - out * y.c) * inverse)


cdef inline Dual through(Dual x, double value, double slope) noexcept nogil:
    # A function of x that has this value and slope there.
    return Dual(value, slope * x.s, slope * x.c)


cdef inline double gone(double x) noexcept nogil:
    # 1 - e^-x, by exp where that loses nothing: in common libraries it is several times as fast as expm1.
    return 1.0 - exp(-x) if x > 1.0 else -expm1(-x)


cdef inline double log_of_one_and(double x) noexcept nogil:
    # log(1 + x), likewise.
    return log(1.0 + x) if x > 1.0 else log1p(x)


cdef inline double log_normal_below(double x) noexcept nogil:
    # log of the probability of a standard normal number below x; far out by its asymptotic series.
    cdef double y
    if x > LOWEST:
        return log(0.5 * erfc(-x * sqrt(0.5)))
    y = 1.0 / (x * x)
    return -0.5 * x * x - log(-x) - HALF_LOG_2PI + log1p(y * (-1.0 + y * (3.0 + y * (-15.0 + 105.0 * y))))


cdef inline double log_sum(double x, double y) noexcept nogil:
    # log(e^x + e^y)
    cdef double top = fmax(x, y)
    return top if isinf(top) else top + log1p(exp(-fabs(x - y)))


cdef struct Chosen:
    # Some of a model's effects, in the order they compose.
    int n
    int each[_MOST_EFFECTS]


cdef struct Places:
    # What has to be looked at for every reading: effects on the zero-tension length, the strain, the creep, the
    # elongation beside it, the guide and the reading; and whether there are none.
    Chosen zero, strain, creep, beside, guide, reading
    bint empty


cdef struct Wire:
    double k1, B, U, k2, N, base, length_mm, log_length_ratio, tension_ref_N, kept
    bint modified, weights
    int effects
    Places* at
    bint own_time, timed  # creep has a rate or a time of its own in each hold; it goes on by another law than eq (5)
    int formula[_MOST_EFFECTS]
    double number[_MOST_EFFECTS]  # the hold of an event, the log of a typical tension or hold
    double own[_MOST_EFFECTS][3]  # amplitudes
    Dual beside[_MOST_EFFECTS]  # elongation beside the creep, as it is carried into the hold
    int clocks  # of the holds so far that are kept in mind
    double late  # by how much every reading is later than recorded, s
    bint aged  # the ages of clocks are those of the protocol
    double solved, elastic, slope  # a strain, its elastic part, and the slope of this


cdef struct Hold:
    double index, order, start_s, direction, displacement_mm
    bint reversed, recorded
    Dual position, carried, tension  # the tension when it begins, or as it is set
    double strain  # under a weight, as it was found for the last reading


cdef inline Dual zero_of(Wire* wire, Hold* hold, Dual elongation, double warming_K) noexcept nogil:
    """Zero-tension length after all effects on it."""
    cdef Dual zero = elongation
    cdef int k, e
    zero.v += wire.length_mm
    for k in range(wire.at.zero.n):
        e = wire.at.zero.each[k]
        if wire.formula[e] == THERMAL:
            zero = times(zero, 1.0 + wire.own[e][0] * warming_K)
        elif wire.formula[e] == SLIP and hold.order >= wire.number[e]:
            zero.v += wire.own[e][0]
    return zero


cdef inline Dual without_toe(Dual strain, double width_mm, Dual strained_mm) noexcept nogil:
    """What pulls of a strain of a length of which a toe straightens first."""
    cdef Dual stretch = product(strain, strained_mm)
    cdef double share = gone(stretch.v / width_mm)
    return minus(strain, quotient(through(stretch, width_mm * share, 1.0 - share), strained_mm))


cdef inline Dual bent(Wire* wire, Dual out, Dual zero) noexcept nogil:
    """A strain after all effects on it."""
    cdef double share, width
    cdef int k, e
    for k in range(wire.at.strain.n):
        e = wire.at.strain.each[k]
        if wire.formula[e] == STIFFENING:
            width = wire.own[e][0]
            out = through(out, out.v * (1.0 + width * out.v), 1.0 + 2.0 * width * out.v)
        elif wire.formula[e] == TOE:
            if wire.own[e][0] > 0 and out.v > 0:
                out = without_toe(out, wire.own[e][0], quotient(zero, minus(constant(1.0), out)) if wire.modified else zero)
        elif wire.formula[e] == TOE_OF_STRAIN:
            if wire.own[e][0] > 0 and out.v > 0:
                out = without_toe(out, wire.own[e][0], constant(wire.length_mm))
        elif wire.formula[e] == POWER:
            if out.v > 0:
                share = pow(out.v * wire.k1 / wire.tension_ref_N, wire.own[e][0])
                out = through(out, out.v * share, (1.0 + wire.own[e][0]) * share)
        elif wire.formula[e] == SERIES:
            out = times(out, 1.0 / (1.0 + wire.own[e][0] * wire.k1 / wire.length_mm))
        elif wire.formula[e] == AT_ONCE and out.v > 0:
            out = elastic_part(wire, out)
    return out


cdef inline Dual strain_of(Wire* wire, Hold* hold, Dual elongation, double warming_K) noexcept nogil:
    """Strain after all effects on length and strain."""
    cdef Dual zero = zero_of(wire, hold, elongation, warming_K), out
    cdef double inverse, share
    if wire.modified:
        inverse = 1.0 / hold.position.v
        out.v = 1.0 - zero.v * inverse
        share = zero.v * inverse * inverse
        out.s = share * hold.position.s - inverse * zero.s
        out.c = share * hold.position.c - inverse * zero.c
    else:
        inverse = 1.0 / zero.v
        out.v = hold.position.v * inverse - 1.0
        share = hold.position.v * inverse * inverse
        out.s = inverse * hold.position.s - share * zero.s
        out.c = inverse * hold.position.c - share * zero.c
    return bent(wire, out, zero)


cdef inline Dual unbent(Wire* wire, Hold* hold, Dual wanted, Dual zero) noexcept nogil:
    """The strain that is this one after all effects on it: `wirebayes.wire.inverse`."""
    cdef double low = 0.0, high = INFINITY, at = hold.strain if hold.strain > 0 else wanted.v, moved
    cdef Dual found, level = constant(zero.v)
    cdef int step
    if wire.at.strain.n == 0 or not wanted.v > 0:
        return wanted
    for step in range(MOST_STEPS):
        found = bent(wire, Dual(at, 1.0, 0.0), level)
        if found.v <= wanted.v and found.s > 0:
            low = at
        else:
            high = at
        moved = at - (found.v - wanted.v) / found.s
        if not (moved >= low and moved <= high and found.s > 0):
            moved = 2.0 * at if isinf(high) else 0.5 * (low + high)
        if not fabs(moved - at) > EXACT * moved:
            at = moved
            break
        at = moved
    found = bent(wire, Dual(at, 1.0, 0.0), level)
    if not (fabs(found.v - wanted.v) <= MISSED * wanted.v and found.s > 0):
        return constant(NAN)
    hold.strain = at
    level = bent(wire, constant(at), zero)
    return Dual(at - (found.v - wanted.v) / found.s, (wanted.s - level.s) / found.s, (wanted.c - level.c) / found.s)


cdef inline Dual position_of(Wire* wire, Hold* hold, Dual elongation, double warming_K) noexcept nogil:
    """Stretched length under the tension of a hold."""
    cdef Dual zero = zero_of(wire, hold, elongation, warming_K)
    cdef Dual strain = unbent(wire, hold, times(hold.tension, 1.0 / wire.k1), zero)
    cdef double longer
    if not wire.modified:
        return product(zero, Dual(1.0 + strain.v, strain.s, strain.c))
    if not strain.v < 1.0:
        return constant(NAN)
    longer = 1.0 / (1.0 - strain.v)
    return product(zero, through(strain, longer, longer * longer))


cdef inline Dual elastic_part(Wire* wire, Dual whole) noexcept nogil:
    """What is elastic of a strain of which the creep of eq (2) is a part."""
    cdef double log_creep, log_s, elastic, crept, move
    cdef int step
    if whole.v == wire.solved:  # so it is at all readings of a hold in which nothing changes
        return through(whole, wire.elastic, wire.slope)
    log_creep = log(wire.B / wire.length_mm) + wire.U * log(wire.k1)
    log_s = log(whole.v)
    if (log_s - log_creep) / wire.U < log_s:
        log_s = (log_s - log_creep) / wire.U
    for step in range(NEWTON_STEPS):
        elastic, crept = exp(log_s), exp(log_creep + wire.U * log_s)
        move = (elastic + crept - whole.v) / (elastic + wire.U * crept)
        log_s -= move
        if fabs(move) < 1e-9:  # the next one would be lost in rounding
            break
    elastic, crept = exp(log_s), exp(log_creep + wire.U * log_s)
    wire.solved, wire.elastic, wire.slope = whole.v, elastic, elastic / (elastic + wire.U * crept)
    return through(whole, wire.elastic, wire.slope)


cdef inline Dual tension_of(Wire* wire, Hold* hold, Dual elongation, double warming_K) noexcept nogil:
    cdef Dual strain = strain_of(wire, hold, elongation, warming_K)
    return times(strain, wire.k1) if strain.v > 0 else constant(0.0)


cdef inline double guided(Wire* wire, Hold* hold) noexcept nogil:
    """Tension beyond the guide, over that of the wire."""
    cdef double out = 1.0
    cdef int k
    for k in range(wire.at.guide.n):
        out *= 1.0 + wire.own[wire.at.guide.each[k]][0] * hold.direction
    return out


cdef inline Dual amount_of(Wire* wire, Hold* hold) noexcept nogil:
    """Creep still to come in a hold, mm."""
    cdef Dual drive = hold.tension, out
    cdef double target
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == THRESHOLD:
            drive.v -= wire.own[e][0]
            if not drive.v > 0:
                drive = constant(0.0)
    if drive.v > 0:
        target = wire.B * pow(drive.v, wire.U)
        out = through(drive, target, wire.U * target / drive.v)
    else:
        out = constant(0.0)
    out = plus(out, times(hold.carried, -wire.kept))
    for e in range(wire.effects):
        if wire.formula[e] == PERMANENT:
            out = plus(out, times(hold.carried, wire.own[e][0]))
        elif wire.formula[e] == AGEING:
            out = times(out, pow(1.0 + hold.index, -wire.own[e][0]))
    return out


cdef inline Dual rate_of(Wire* wire, Hold* hold) noexcept nogil:
    """k2 in a hold."""
    cdef Dual out = constant(wire.k2), ratio
    cdef double power
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == RATE_POWER:
            ratio = times(hold.tension, 1.0 / wire.tension_ref_N)
            if not ratio.v > LEAST_RATE_RATIO:
                ratio = constant(LEAST_RATE_RATIO)
            power = pow(ratio.v, wire.own[e][0])
            out = product(out, through(ratio, power, wire.own[e][0] * power / ratio.v))
    return out


cdef inline double clock_of(Wire* wire, Hold* hold, double time_s, bint first) noexcept nogil:
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == DELAY and first and hold.recorded:
            time_s += wire.own[e][0]
    return time_s


cdef inline Dual fraction_of(Dual rate, double reach) noexcept nogil:
    """Share of the amount reached after a time, to the power N, the rate having derivatives."""
    cdef double share = gone(rate.v * reach)
    return through(rate, share, reach * (1.0 - share))


cdef inline double law_of_time(Wire* wire, double time_s) noexcept nogil:
    """Share of the amount reached after a time by another law than eq (5): the last one named."""
    cdef double share = 0.0, a
    cdef int e
    for e in range(wire.effects):
        a = wire.own[e][0]
        if wire.formula[e] == NOT_IN_TIME:
            share = 0.0
        elif wire.formula[e] == LOGARITHMIC:
            share = log1p(time_s / a) / log1p(wire.number[e] / a)
        elif wire.formula[e] == POWER_OF_TIME:
            share = pow(time_s / wire.number[e], a)
        elif wire.formula[e] == TWO_MODES:
            share = (1.0 - a) * gone(wire.k2 * time_s) + a * gone(wire.k2 * time_s / wire.own[e][1])
    return share


cdef inline Dual reading_of(
    Wire* wire, Hold* hold, Dual shown, double time_s, double[:, ::1] shares, int which
) noexcept nogil:
    """What the sensor says of a tension, or the gauge of a displacement."""
    cdef double a
    cdef int k, e
    for k in range(wire.at.reading.n):
        e = wire.at.reading.each[k]
        a = wire.own[e][0]
        if wire.formula[e] == DRIFT:
            shown.v += a * (hold.start_s + time_s)
        elif wire.formula[e] == SQUARE:
            shown = through(shown, shown.v * (1.0 + a * shown.v), 1.0 + 2.0 * a * shown.v)
        elif wire.formula[e] == TRANSIENT:
            shown = times(shown, 1.0 + a * shares[1 + e, which])
    return shown


cdef class Test:
    """What was done to a wire, as contiguous arrays (see `wirebayes.wire.protocol.Protocol`)."""

    cdef int holds, width, read_times  # of `times`, which begin with those of readings
    cdef double length_mm
    cdef double[:, ::1] time_s, warming_K
    cdef double[::1] setting, start_s, order, direction, times, log_times
    cdef bint weights
    cdef int[:, ::1] which  # of `times`
    cdef int[:, :, ::1] which_age  # of `times`: since an earlier hold began, at the start of a hold and at its readings
    cdef int[::1] last
    cdef unsigned char[::1] recorded

    def __init__(self, double length_mm, bint weights, setting, time_s, warming_K, start_s, order, direction, times,
                 log_times, which, last, recorded, which_age, int read_times):
        self.length_mm, self.weights = length_mm, weights
        self.setting, self.time_s, self.warming_K = setting, time_s, warming_K
        self.start_s, self.order, self.direction = start_s, order, direction
        self.times, self.log_times = times, log_times
        self.which, self.last, self.recorded, self.which_age = which, last, recorded, which_age
        self.holds, self.width = self.time_s.shape[0], self.time_s.shape[1]
        self.read_times = read_times


cdef inline Dual superposed(
    Wire* wire, Hold* hold, Test test, int j, int r, double time_s, Dual rate, double[:, ::1] shares,
    double[:, ::1] past
) noexcept:
    """Creep that the clocks of all holds add up to, the last one being this hold's, at its reading `r` (-1: another)."""
    cdef Dual total = constant(0.0), before = constant(0.0), goal, step
    cdef double reach
    cdef int i, first = j + 1 - wire.clocks  # the hold of the first clock
    for i in range(wire.clocks):
        goal = Dual(past[i, 2], past[i, 3], past[i, 4])
        step = minus(goal, before)
        before = goal
        if wire.aged and r >= 0:
            total = plus(total, times(step, shares[0, test.which_age[j, first + i, r + 1]]))
            continue
        reach = pow(hold.start_s - past[i, 0] + time_s, wire.N)
        if i < wire.clocks - 1:
            total = plus(total, times(step, gone(past[i, 1] * reach)))
        else:
            total = plus(total, product(step, fraction_of(rate, reach)))
    return total


cdef inline void keep_in_mind(Wire* wire, Hold* hold, Dual goal, double rate, double[:, ::1] past) noexcept:
    """The clock of a hold that begins."""
    cdef int i = wire.clocks
    past[i, 0], past[i, 1], past[i, 2], past[i, 3], past[i, 4] = hold.start_s, rate, goal.v, goal.s, goal.c
    wire.clocks += 1


cdef inline Dual beside_at(
    Wire* wire, Hold* hold, Test test, int e, int j, int r, double time_s, double share, Dual grown, Dual rate,
    double[:, ::1] shares, double[:, ::1] past
) noexcept:
    """Elongation beside the creep at a time of a hold; `share` is that of a second mode's course."""
    cdef Dual course
    if wire.formula[e] == SECOND_MODE:
        return plus(times(hold.tension, wire.own[e][0] * share), times(wire.beside[e], 1.0 - share))
    if wire.formula[e] == FLOW:
        return plus(times(hold.tension, wire.own[e][0] * time_s), wire.beside[e])
    course = superposed(wire, hold, test, j, r, time_s, rate, shares, past)
    return times(minus(course, grown), wire.own[e][0])


cdef class Law:
    """Which wire: law, history, formulas of its effects with a number each, and constants they refer to."""

    cdef bint modified
    cdef double kept, tension_ref_N, log_length_ratio
    cdef int effects
    cdef int formula[_MOST_EFFECTS]
    cdef int amplitudes[_MOST_EFFECTS]
    cdef double number[_MOST_EFFECTS]
    cdef Places at

    def __init__(self, bint modified, double kept, double tension_ref_N, double log_length_ratio, formulas):
        self.modified, self.kept, self.tension_ref_N = modified, kept, tension_ref_N
        self.log_length_ratio = log_length_ratio
        self.effects = len(formulas)
        for e, (name, amplitudes, number) in enumerate(formulas):
            self.formula[e] = FORMULAS.index(name)
            self.amplitudes[e], self.number[e] = amplitudes, number
        self.choose(&self.at.zero, (THERMAL, SLIP))
        self.choose(&self.at.strain, (STIFFENING, TOE, TOE_OF_STRAIN, POWER, SERIES, AT_ONCE))
        self.choose(&self.at.creep, (FLOW_CARRIED,))
        self.choose(&self.at.beside, (SUPERPOSITION, SECOND_MODE, FLOW))
        self.choose(&self.at.guide, (FRICTION,))
        self.choose(&self.at.reading, (DRIFT, SQUARE, TRANSIENT))
        self.at.empty = not (self.at.zero.n + self.at.strain.n + self.at.creep.n + self.at.beside.n + self.at.guide.n
                             + self.at.reading.n)

    cdef void choose(self, Chosen* chosen, tuple formulas):
        """The effects with one of these formulas."""
        cdef int e
        chosen.n = 0
        for e in range(self.effects):
            if self.formula[e] in formulas:
                chosen.each[chosen.n] = e
                chosen.n += 1


cdef inline double power_of_time(Wire* wire, Test test, int t) noexcept:
    """A distinct time to the power N; whose logarithm is known where no reading comes late."""
    return exp(wire.N * test.log_times[t]) if wire.late == 0.0 else pow(test.times[t] + wire.late, wire.N)


cdef void follow_length(Wire* wire, Law law, int e) noexcept:
    """Let a parameter grow with the length; creep at the typical tension and after a typical hold stays as it is."""
    cdef double grown = exp(law.log_length_ratio * wire.own[e][0]), before
    if law.formula[e] == K1_OF_LENGTH:
        wire.k1 *= grown
    elif law.formula[e] == B_OF_LENGTH:
        wire.B *= grown
    elif law.formula[e] == U_OF_LENGTH:
        before = wire.U
        wire.U *= grown
        wire.B *= exp(law.number[e] * (before - wire.U))
    else:
        before = wire.N
        wire.N *= grown
        wire.k2 *= exp(law.number[e] * (before - wire.N))


cdef void take(
    Wire* wire, Law law, Test test, const double[:, ::1] theta, Py_ssize_t i, double[:, ::1] shares
) noexcept:
    """The wire of column `i`: parameters k1 B U k2 N preload, then amplitudes.

    Also what depends on time alone, at each of the distinct times: the share of creep reached, or, where rates differ,
    the time to the power N; then, of an effect that has one, the share of its own course.
    """
    cdef int e, row = 6, a, t
    wire.k1, wire.B, wire.U, wire.k2, wire.N = theta[0, i], theta[1, i], theta[2, i], theta[3, i], theta[4, i]
    wire.length_mm, wire.base = test.length_mm, test.length_mm + theta[5, i]
    wire.modified, wire.kept, wire.tension_ref_N = law.modified, law.kept, law.tension_ref_N
    wire.weights = test.weights
    wire.effects, wire.at, wire.own_time, wire.timed, wire.solved = law.effects, &law.at, False, False, 0.0
    wire.clocks, wire.late, wire.aged = 0, 0.0, test.which_age.shape[0] > 0
    for e in range(law.effects):
        wire.formula[e], wire.number[e], wire.beside[e] = law.formula[e], law.number[e], constant(0.0)
        for a in range(law.amplitudes[e]):
            wire.own[e][a] = theta[row, i]
            row += 1
        if law.formula[e] == RATE_POWER or law.formula[e] == DELAY:
            wire.own_time = True
        elif NOT_IN_TIME <= law.formula[e] <= TWO_MODES:
            wire.timed = True
        elif law.formula[e] == LATE:
            wire.late += wire.own[e][0]
        if law.formula[e] in (BEFORE, WAIT, LATE):
            wire.aged = False
        if K1_OF_LENGTH <= law.formula[e] <= N_OF_LENGTH:
            follow_length(wire, law, e)
    wire.own_time = wire.own_time and not wire.timed  # another law of time has no rate
    wire.aged = wire.aged and not (wire.own_time or wire.timed)
    if wire.timed:
        for t in range(test.times.shape[0]):
            shares[0, t] = law_of_time(wire, test.times[t] + wire.late)
    elif wire.own_time:
        for t in range(test.times.shape[0]):
            shares[0, t] = power_of_time(wire, test, t)
    else:
        for t in range(test.times.shape[0]):
            shares[0, t] = gone(wire.k2 * power_of_time(wire, test, t))
    for e in range(law.effects):
        if law.formula[e] == SECOND_MODE:
            for t in range(test.read_times):
                shares[1 + e, t] = gone((test.times[t] + wire.late) / wire.own[e][1])
        elif law.formula[e] == TRANSIENT:
            for t in range(test.read_times):
                shares[1 + e, t] = exp(-(test.times[t] + wire.late) / wire.own[e][1])


cdef inline double set_in(Wire* wire, Test test, int j) noexcept:
    """Stretched length or tension that is set in a hold."""
    return test.setting[j] if wire.weights else wire.base + test.setting[j]


cdef double rested(Wire* wire, Hold* hold, Test test, double[:, ::1] shares, double[:, ::1] past) noexcept:
    """Creep that the wire brings into the first hold, mm; what is beside it stays in `wire`."""
    cdef double before = 0.0
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == BEFORE:
            before += wire.own[e][0]
    if before == 0.0:
        return 0.0
    enter(wire, hold, test, 0, 0.0 if wire.weights else wire.base, 0.0, 0.0)
    wait(wire, hold, test, 0, before, shares, past)
    hold.carried = constant(hold.carried.v)
    return hold.carried.v


cdef inline double waited(Wire* wire, double order) noexcept nogil:
    """How long the wire waits before a hold of this order begins, s."""
    cdef double total = 0.0
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == WAIT and order == wire.number[e]:
            total += wire.own[e][0]
    return total


cdef void begin(
    Wire* wire, Hold* hold, Test test, int j, double setting, double carried, double[:, ::1] shares,
    double[:, ::1] past
) noexcept:
    """Hold `j` at its first moment; what is set is a stretched length, or a tension."""
    cdef int i
    cdef double before
    for i in range(wire.clocks):
        past[i, 3] = past[i, 4] = 0.0
    enter(wire, hold, test, j, setting, 0.0 if wire.weights else test.setting[j], carried)
    before = waited(wire, hold.order)
    if before != 0.0:
        wait(wire, hold, test, j, before, shares, past)


cdef void enter(
    Wire* wire, Hold* hold, Test test, int j, double setting, double displacement_mm, double carried
) noexcept:
    """Hold `j` as its setting is reached."""
    cdef int e
    cdef double loose
    hold.index, hold.order, hold.start_s = j, test.order[j], test.start_s[j] + j * wire.late
    hold.direction, hold.recorded, hold.displacement_mm = test.direction[j], test.recorded[j], displacement_mm
    hold.reversed = test.direction[j] != test.direction[0]
    hold.carried, hold.strain = Dual(carried, 0.0, 1.0), 0.0
    for e in range(wire.effects):
        wire.beside[e] = constant(wire.beside[e].v)
    if wire.weights:
        loose = guided(wire, hold)
        hold.tension = times(Dual(setting, 1.0, 0.0), 1.0 / loose if loose > 0 else NAN)
    else:
        hold.position = Dual(setting + off(wire, hold, constant(displacement_mm)).v, 1.0, 0.0)
        hold.tension = tension_of(wire, hold, plus(hold.carried, beside_of(wire)), test.warming_K[j, 0])


cdef void wait(
    Wire* wire, Hold* hold, Test test, int j, double time_s, double[:, ::1] shares, double[:, ::1] past
) noexcept:
    """Time passes before hold `j` begins, as in a hold that nobody reads."""
    cdef Dual amount = amount_of(wire, hold), rate = rate_of(wire, hold), fraction
    cdef double share
    cdef int k, e, i
    if wire.at.beside.n:
        keep_in_mind(wire, hold, plus(hold.carried, amount), rate.v, past)
    fraction = constant(law_of_time(wire, time_s)) if wire.timed else fraction_of(rate, pow(time_s, wire.N))
    hold.carried = plus(hold.carried, product(amount, fraction))
    for k in range(wire.at.creep.n):  # flow that is carried
        hold.carried = plus(hold.carried, times(hold.tension, wire.own[wire.at.creep.each[k]][0] * time_s))
    for k in range(wire.at.beside.n):
        e = wire.at.beside.each[k]
        share = gone(time_s / wire.own[e][1]) if wire.formula[e] == SECOND_MODE else 0.0
        wire.beside[e] = beside_at(wire, hold, test, e, j, -1, time_s, share, hold.carried, rate, shares, past)
    for i in range(wire.clocks):
        past[i, 0] -= time_s
    if not wire.weights:
        hold.tension = tension_of(wire, hold, plus(hold.carried, beside_of(wire)), test.warming_K[j, 0])


cdef inline Dual off(Wire* wire, Hold* hold, Dual displacement) noexcept nogil:
    """What effects on the position add to a displacement, mm."""
    cdef Dual total = constant(0.0)
    cdef double turns, phase
    cdef int e
    for e in range(wire.effects):
        if wire.formula[e] == LOST_MOTION and hold.reversed:
            total.v -= wire.own[e][0] * hold.direction
        elif wire.formula[e] == SCREW:
            turns = 2.0 * PI / wire.own[e][1]
            phase = turns * displacement.v + wire.own[e][2]
            total = plus(total, through(displacement, wire.own[e][0] * cos(phase), -wire.own[e][0] * turns * sin(phase)))
    return total


cdef inline Dual beside_of(Wire* wire) noexcept nogil:
    cdef Dual total = constant(0.0)
    cdef int k
    for k in range(wire.at.beside.n):
        total = plus(total, wire.beside[wire.at.beside.each[k]])
    return total


cdef Dual follow(
    Wire* wire, Hold* hold, Test test, int j, int width, double[:, ::1] shares, double[:, ::1] past, Dual* readings
) noexcept:
    """The first readings of a hold that has begun, `width` of them.

    Returns the creep carried out, and leaves what is beside it in `wire`.
    """
    cdef Dual amount = amount_of(wire, hold), rate = rate_of(wire, hold), grown, total, course, out
    cdef double time_s, clock_s, share
    cdef Dual last[_MOST_EFFECTS]
    cdef int r, k, e
    if wire.at.empty and not (wire.own_time or wire.modified or wire.weights):
        follow_hooke(wire, hold, test, j, width, amount, shares, readings)
        return plus(hold.carried, times(amount, shares[0, test.which[j, test.last[j]]]))
    if wire.at.beside.n:
        keep_in_mind(wire, hold, plus(hold.carried, amount), rate.v, past)
    out = hold.carried
    for r in range(width):
        time_s = test.time_s[j, r] + wire.late
        if wire.own_time:
            clock_s = clock_of(wire, hold, time_s, r == 0)
            share = shares[0, test.which[j, r]] if clock_s == time_s else pow(clock_s, wire.N)
            grown = product(amount, fraction_of(rate, share))
        else:
            grown = times(amount, shares[0, test.which[j, r]])
        grown = plus(hold.carried, grown)
        for k in range(wire.at.creep.n):  # flow that is carried
            grown = plus(grown, times(hold.tension, wire.own[wire.at.creep.each[k]][0] * time_s))
        total = grown
        for k in range(wire.at.beside.n):
            e = wire.at.beside.each[k]
            share = shares[1 + e, test.which[j, r]]
            course = beside_at(wire, hold, test, e, j, r, time_s, share, grown, rate, shares, past)
            total = plus(total, course)
            if r == test.last[j]:
                last[e] = course
        if r == test.last[j]:
            out = grown
        if wire.weights:
            total = position_of(wire, hold, total, test.warming_K[j, r])
            total.v -= wire.base
            total = plus(total, off(wire, hold, total))
        else:
            total = times(tension_of(wire, hold, total, test.warming_K[j, r]), guided(wire, hold))
        readings[r] = reading_of(wire, hold, total, time_s, shares, test.which[j, r])
    for k in range(wire.at.beside.n):
        e = wire.at.beside.each[k]
        wire.beside[e] = last[e] if width > test.last[j] else wire.beside[e]
    return out


cdef inline void follow_hooke(
    Wire* wire, Hold* hold, Test test, int j, int width, Dual amount, double[:, ::1] shares, Dual* readings
) noexcept:
    """The usual case of `follow`, which does the same: eq (1), and no effect to look at for every reading."""
    cdef double share, inverse, strain, slope
    cdef int r
    for r in range(width):
        share = shares[0, test.which[j, r]]
        inverse = 1.0 / (hold.carried.v + amount.v * share + wire.length_mm)
        strain, slope = hold.position.v * inverse - 1.0, hold.position.v * inverse * inverse
        if strain > 0:
            readings[r].v = strain * wire.k1
            readings[r].s = (inverse - slope * (hold.carried.s + amount.s * share)) * wire.k1
            readings[r].c = -slope * (hold.carried.c + amount.c * share) * wire.k1
        else:
            readings[r] = constant(0.0)


cdef class Staircases:
    """Where filters find staircases, a column of parameters each: one after the other, for they look at each once."""

    cdef readonly Py_ssize_t n
    cdef int holds, width
    cdef Dual* readings  # (holds, width) of the column that was asked for
    cdef Dual* carry  # (holds,): creep carried out of each
    cdef double brought  # creep carried into the first
    cdef unsigned char[::1] near  # (holds,): whether the setting error decides if the wire is taut
    cdef Dual* stretch  # (holds,): of the wire when each begins
    cdef Dual* taut  # as `readings` and `carry`, of a wire that is known to be taut there, and to be slack
    cdef Dual* taut_carry
    cdef Dual* slack
    cdef Dual* slack_carry
    cdef double[:, ::1] memory

    cdef void allocate(self, Py_ssize_t n, int holds, int width):
        self.n, self.holds, self.width = n, holds, width
        self.near = np.zeros(holds, np.uint8)
        self.memory = np.empty((3 * holds * width + 4 * holds + 1, 3))
        self.readings = <Dual*> &self.memory[0, 0]
        self.taut = self.readings + holds * width
        self.slack = self.taut + holds * width
        self.carry = self.slack + holds * width
        self.taut_carry = self.carry + holds
        self.slack_carry = self.taut_carry + holds
        self.stretch = self.slack_carry + holds

    cdef void ask(self, Py_ssize_t i) noexcept:
        """Column `i`."""


cdef inline Dual stretched_by(Wire* wire, Hold* hold, double warming_K) noexcept nogil:
    """By how much the wire is longer than without tension when a hold begins, mm."""
    return minus(hold.position, zero_of(wire, hold, plus(hold.carried, beside_of(wire)), warming_K))


cdef class Computed(Staircases):
    """Staircases as they are computed."""

    cdef Test test
    cdef Law law
    cdef const double[:, ::1] theta
    cdef const double[::1] spread  # of setting errors, mm, or none
    cdef const double[:, :] first  # the first reading of each hold, NaN or none where it is not known
    cdef const Py_ssize_t[::1] column  # and in which column it stands
    cdef const double[::1] variance  # of a reading
    cdef double[:, ::1] past
    cdef double[:, ::1] shares

    def __init__(self, Test test, Law law, const double[:, ::1] theta, const double[::1] spread,
                 const double[:, :] first, const Py_ssize_t[::1] column, const double[::1] variance):
        if spread.shape[0] not in (0, theta.shape[1]):
            raise ValueError("setting errors and columns are of different sizes")
        if first.shape[0] and (first.shape[0] != test.holds or column.shape[0] != test.holds
                               or first.shape[1] not in (1, theta.shape[1]) or variance.shape[0] != theta.shape[1]):
            raise ValueError("readings and columns are of different sizes")
        self.allocate(theta.shape[1], test.holds, test.width)
        self.test, self.law, self.theta, self.spread = test, law, theta, spread
        self.first, self.column, self.variance = first, column, variance
        self.past, self.shares = np.empty((2 * test.holds + 1, 5)), np.empty((1 + law.effects, test.times.shape[0]))

    cdef void ask(self, Py_ssize_t i) noexcept:
        cdef Wire wire, before
        cdef Hold hold
        cdef double creep = 0.0, spread = fabs(self.spread[i]) if self.spread.shape[0] else 0.0, waits
        cdef int j
        take(&wire, self.law, self.test, self.theta, i, self.shares)
        creep = self.brought = rested(&wire, &hold, self.test, self.shares, self.past)
        for j in range(self.holds):
            waits = waited(&wire, self.test.order[j])
            if waits != 0.0:
                before = wire
            begin(&wire, &hold, self.test, j, set_in(&wire, self.test, j), creep, self.shares, self.past)
            self.near[j] = False
            if spread > 0.0 and not wire.weights:
                self.stretch[j] = stretched_by(&wire, &hold, self.test.warming_K[j, 0])
                self.near[j] = self.stretch[j].v < FAR * spread
            if self.near[j]:
                if waits == 0.0:
                    before = wire
                self.look_aside(&before, j, i, waits, creep, spread)
                self.undo_wait(&before, waits)
                wire = before
                begin(&wire, &hold, self.test, j, set_in(&wire, self.test, j), creep, self.shares, self.past)
            self.carry[j] = follow(&wire, &hold, self.test, j, self.width, self.shares, self.past,
                                   self.readings + j * self.width)
            creep = self.carry[j].v
            if self.near[j]:
                self.taut_carry[j].v -= creep
                self.slack_carry[j].v -= creep

    cdef void look_aside(
        self, Wire* before, int j, Py_ssize_t i, double waits, double creep, double spread
    ) noexcept:
        """Hold `j` on both sides of its edge: `wirebayes.wire.edges`."""
        cdef double ratio = self.stretch[j].v / spread
        cdef double hazard = exp(-0.5 * ratio * ratio - HALF_LOG_2PI - log_normal_below(ratio))
        cdef double to_taut = fmax(hazard, LEAST_STRETCH - ratio) * spread
        cdef double to_slack = -fmax(self.stretch[j].v + spread, 0.0)
        cdef double closer
        self.taut_carry[j] = self.aside(before, j, waits, creep, to_taut, self.taut + j * self.width)
        closer = self.as_read(j, i, to_taut, spread)
        if closer != to_taut:
            self.taut_carry[j] = self.aside(before, j, waits, creep, closer, self.taut + j * self.width)
        self.slack_carry[j] = self.aside(before, j, waits, creep, to_slack, self.slack + j * self.width)

    cdef double as_read(self, int j, Py_ssize_t i, double to_taut, double spread) noexcept:
        """A setting error nearer to what the first reading says of it: `wirebayes.wire.edges.nearer_as_read`."""
        cdef double first, slope, error, ratio = self.stretch[j].v / spread, q = spread * spread
        cdef Dual line
        if not self.first.shape[0]:
            return to_taut
        first = self.first[j, i if self.first.shape[1] > 1 else 0]
        if isnan(first):
            return to_taut
        line = self.taut[j * self.width + self.column[j]]
        error = q * line.s / (q * line.s * line.s + self.variance[i]) * (first - line.v)
        if not error < MOST_ERROR * spread:
            error = MOST_ERROR * spread
        error = fmax(error, (LEAST_READ - ratio) * spread)
        return to_taut + (1.0 if ratio < FAR - 1.0 else FAR - ratio) * (error - to_taut)

    cdef void undo_wait(self, Wire* before, double waits) noexcept:
        """Set the clocks back to where they stood before the wire waited for a hold to begin."""
        cdef int i
        for i in range(before.clocks):
            self.past[i, 0] += waits

    cdef Dual aside(self, Wire* before, int j, double waits, double creep, double moved, Dual* readings) noexcept:
        """Readings of hold `j`, and the creep that it carries out, expanded at a setting error."""
        cdef Wire wire = before[0]
        cdef Hold hold
        cdef Dual out
        cdef int r
        self.undo_wait(before, waits)
        begin(&wire, &hold, self.test, j, set_in(&wire, self.test, j) + moved, creep, self.shares, self.past)
        out = follow(&wire, &hold, self.test, j, self.width, self.shares, self.past, readings)
        for r in range(self.width):
            readings[r].v -= readings[r].s * moved
        return Dual(out.v - out.s * moved, out.s, out.c)


cdef class Stored(Staircases):
    """Staircases that were computed before (see `wirebayes.wire.staircase.Linearised`), and their edges, if any.

    Edges are what `linearise` returns of them.
    """

    cdef const double[:, :, ::1] tension, by_setting, by_creep
    cdef const double[:, ::1] carry_by_setting, carry_by_creep
    cdef const unsigned char[:, ::1] is_near
    cdef const double[:, :, :, ::1] if_taut, if_slack
    cdef const double[:, :, ::1] stretches, taut_carries, slack_carries

    def __init__(self, const double[:, :, ::1] tension, const double[:, :, ::1] by_setting,
                 const double[:, :, ::1] by_creep, const double[:, ::1] carry_by_setting,
                 const double[:, ::1] carry_by_creep, edges=None):
        self.allocate(tension.shape[2], tension.shape[0], tension.shape[1])
        self.tension, self.by_setting, self.by_creep = tension, by_setting, by_creep
        self.carry_by_setting, self.carry_by_creep = carry_by_setting, carry_by_creep
        self.is_near = np.zeros((0, 0), np.uint8)
        if edges is not None:
            self.is_near, self.stretches, self.if_taut, self.taut_carries, self.if_slack, self.slack_carries = edges

    cdef void ask(self, Py_ssize_t i) noexcept:
        cdef int j, r
        for j in range(self.holds):
            for r in range(self.width):
                self.readings[j * self.width + r] = Dual(
                    self.tension[j, r, i], self.by_setting[j, r, i], self.by_creep[j, r, i]
                )
            self.carry[j] = Dual(0.0, self.carry_by_setting[j, i], self.carry_by_creep[j, i])
            self.near[j] = self.is_near.shape[0] and self.is_near[j, i]
            if self.near[j]:
                self.stretch[j] = read_one(self.stretches, j, i)
                self.taut_carry[j], self.slack_carry[j] = read_one(self.taut_carries, j, i), read_one(self.slack_carries, j, i)
                for r in range(self.width):
                    self.taut[j * self.width + r] = Dual(
                        self.if_taut[0, j, r, i], self.if_taut[1, j, r, i], self.if_taut[2, j, r, i]
                    )
                    self.slack[j * self.width + r] = Dual(
                        self.if_slack[0, j, r, i], self.if_slack[1, j, r, i], self.if_slack[2, j, r, i]
                    )


cdef inline Dual read_one(const double[:, :, ::1] values, int j, Py_ssize_t i) noexcept:
    return Dual(values[0, j, i], values[1, j, i], values[2, j, i])


def linearise(
    Test test, Law law, const double[:, ::1] theta, const double[::1] spread, const double[:, :] first,
    const Py_ssize_t[::1] column, const double[::1] variance
):
    """Staircases (see `wirebayes.wire.staircase.Linearised`), a column of `theta` each, and their edges.

    These are None, or which holds are near one, the stretch (3, H, n), and of a wire that is taut and of one that is
    slack readings (3, H, R, n) and what is carried out (3, H, n).
    """
    cdef Staircases made = Computed(test, law, theta, spread, first, column, variance)
    cdef int holds = made.holds, width = made.width, j
    cdef Py_ssize_t i
    each = np.empty((3, holds, width, made.n))
    carry = np.empty((2, holds, made.n))
    creep = np.zeros((holds + 1, made.n))
    edges = None
    cdef double[:, :, :, ::1] y = each, taut, slack
    cdef double[:, :, ::1] c = carry, stretch, taut_carry, slack_carry
    cdef double[:, ::1] e = creep
    cdef unsigned char[:, ::1] near
    for i in range(made.n):
        made.ask(i)
        e[0, i] = made.brought
        for j in range(holds):
            write(made.readings + j * width, y, j, i, width)
            e[j + 1, i], c[0, j, i], c[1, j, i] = made.carry[j].v, made.carry[j].s, made.carry[j].c
            if not made.near[j]:
                continue
            if edges is None:
                edges = (np.zeros((holds, made.n), np.uint8), np.zeros((3, holds, made.n)),
                         np.zeros_like(each), np.zeros((3, holds, made.n)),
                         np.zeros_like(each), np.zeros((3, holds, made.n)))
                near, stretch, taut, taut_carry, slack, slack_carry = edges
            near[j, i] = True
            write_one(made.stretch[j], stretch, j, i)
            write(made.taut + j * width, taut, j, i, width)
            write_one(made.taut_carry[j], taut_carry, j, i)
            write(made.slack + j * width, slack, j, i, width)
            write_one(made.slack_carry[j], slack_carry, j, i)
    return (each[0], each[1], each[2], carry[0], carry[1], creep), edges


cdef inline void write(Dual* readings, double[:, :, :, ::1] to, int j, Py_ssize_t i, int width) noexcept:
    """The readings of a hold in column `i`."""
    cdef int r
    for r in range(width):
        to[0, j, r, i], to[1, j, r, i], to[2, j, r, i] = readings[r].v, readings[r].s, readings[r].c


cdef inline void write_one(Dual value, double[:, :, ::1] to, int j, Py_ssize_t i) noexcept:
    to[0, j, i], to[1, j, i], to[2, j, i] = value.v, value.s, value.c


def simulate(Test test, Law law, const double[:, ::1] theta, const double[:, :] setting_error, bint each_alone=False):
    """Noise-free readings (H, R, n); `setting_error` (H, n) or (H, 1); of holds without a past if `each_alone`."""
    cdef Py_ssize_t n = theta.shape[1], i
    cdef int holds = test.holds, width = test.width, j, r
    out = np.empty((holds, width, n))
    cdef double[:, :, ::1] y = out
    cdef double[:, ::1] past = np.empty((2 * holds + 1, 5)), scratch = np.empty((width, 3))
    cdef double[:, ::1] shares = np.empty((1 + law.effects, test.times.shape[0]))
    cdef Dual* readings = <Dual*> &scratch[0, 0]
    cdef double creep, moved
    cdef Wire wire
    cdef Hold hold
    if setting_error.shape[0] != holds or setting_error.shape[1] not in (1, n):
        raise ValueError("setting errors and columns are of different sizes")
    for i in range(n):
        take(&wire, law, test, theta, i, shares)
        creep = 0.0 if each_alone else rested(&wire, &hold, test, shares, past)
        for j in range(holds):
            moved = setting_error[j, i if setting_error.shape[1] > 1 else 0]
            if each_alone:
                alone(&wire, &hold, test, j, width, set_in(&wire, test, j) + moved, shares, past, readings)
            else:
                begin(&wire, &hold, test, j, set_in(&wire, test, j) + moved, creep, shares, past)
                creep = follow(&wire, &hold, test, j, width, shares, past, readings).v
            for r in range(width):
                y[j, r, i] = readings[r].v
    return out


def courses(Test test, Law law, const double[:, ::1] theta, const double[:, :] first_N, int most_steps):
    """Tensions and slopes (H, R, n) of holds without a past, each as far stretched as its first reading (H, n) says."""
    cdef Py_ssize_t n = theta.shape[1], i
    cdef int holds = test.holds, width = test.width, j, r, step
    tension, slope = np.zeros((holds, width, n)), np.zeros((holds, width, n))
    cdef double[:, :, ::1] y = tension, by = slope
    cdef double[:, ::1] past = np.empty((2 * holds + 1, 5)), scratch = np.empty((width, 3))
    cdef double[:, ::1] shares = np.empty((1 + law.effects, test.times.shape[0]))
    cdef Dual* readings = <Dual*> &scratch[0, 0]
    cdef double wanted, stretched, move
    cdef Wire wire
    cdef Hold hold
    for i in range(n):
        take(&wire, law, test, theta, i, shares)
        for j in range(holds):
            if not test.recorded[j]:
                continue
            wanted = first_N[j, i] if first_N[j, i] > 0 else 1.0
            stretched = test.length_mm * (1.0 + wanted / wire.k1)
            if wire.modified:
                stretched = test.length_mm / fmax(1.0 - wanted / wire.k1, 0.1)
            for step in range(most_steps):
                alone(&wire, &hold, test, j, 1, stretched, shares, past, readings)
                if readings[0].s > 0:
                    move = (wanted - readings[0].v) / readings[0].s
                else:  # a slack guess has no slope: go out until it pulls
                    move = wanted / wire.k1 * test.length_mm
                stretched += move
                if fabs(move) < 1e-12 * test.length_mm:
                    break
            alone(&wire, &hold, test, j, width, stretched, shares, past, readings)
            for r in range(width):
                y[j, r, i], by[j, r, i] = readings[r].v, readings[r].s
    return tension, slope


cdef void alone(
    Wire* wire, Hold* hold, Test test, int j, int width, double setting, double[:, ::1] shares, double[:, ::1] past,
    Dual* readings
) noexcept:
    """The first readings of a hold without a past."""
    cdef int e
    for e in range(wire.effects):
        wire.beside[e] = constant(0.0)
    wire.clocks = 0
    begin(wire, hold, test, j, setting, 0.0, shares, past)
    follow(wire, hold, test, j, width, shares, past, readings)


cdef struct Read:
    # What the readings of one hold say: see `wirebayes.model.hold_filter.HoldRead`.
    double log_density, mean, var, pull_c, pull_s, cc, ss, v_cc, v_cs, v_ss
    bint is_taut  # of a hold near an edge, whether a taut wire is the more probable


cdef struct Noise:
    # Of a reading 1 / variance, and its log normal density's constant; the variance of a setting error.
    double weight, log_variance, q


cdef inline Read read_line(
    Dual* line, Dual carry, int width, const double[:, :, :] readings, const unsigned char[:, ::1] mask, int j,
    Py_ssize_t i, double m, double p, Noise noise, double* left
) noexcept:
    """Filter one hold: the creep carried into it has mean m and variance p."""
    cdef double cc = 0.0, cs = 0.0, ss = 0.0, cr = 0.0, sr = 0.0, square = 0.0, residual, det, v_cc, v_cs, v_ss
    cdef double post_c, post_s, weight = noise.weight, q = noise.q
    cdef int r, count = 0
    cdef Read out
    i = i if readings.shape[2] > 1 else 0  # all columns see the same
    for r in range(width):
        if mask[j, r]:
            residual = readings[j, r, i] - line[r].v - line[r].c * m
            left[count] = residual
            count += 1
            cc += line[r].c * line[r].c
            cs += line[r].c * line[r].s
            ss += line[r].s * line[r].s
            cr += line[r].c * residual
            sr += line[r].s * residual
    cc, cs, ss, cr, sr = cc * weight, cs * weight, ss * weight, cr * weight, sr * weight
    # the difference of two products may come out below zero by rounding
    det = 1.0 + p * cc + q * ss + p * q * fmax(cc * ss - cs * cs, 0.0)
    v_cc, v_cs, v_ss = p * (1.0 + q * ss) / det, -p * q * cs / det, q * (1.0 + p * cc) / det
    post_c, post_s = v_cc * cr + v_cs * sr, v_cs * cr + v_ss * sr
    out.pull_c = ((1.0 + q * ss) * cr - q * cs * sr) / det
    out.pull_s = ((1.0 + p * cc) * sr - p * cs * cr) / det
    count = 0
    for r in range(width):
        if mask[j, r]:
            # a sum of squares: the shorter difference of products can turn negative at absurd parameters
            residual = left[count] - line[r].c * post_c - line[r].s * post_s
            left[count] = residual
            square += residual * residual
            count += 1
    square = square * weight + p * out.pull_c * out.pull_c + q * out.pull_s * out.pull_s
    out.log_density = -0.5 * (square + count * noise.log_variance + log(det))
    out.mean = carry.c * (m + post_c) + carry.s * post_s
    out.var = carry.c * carry.c * v_cc + 2.0 * carry.c * carry.s * v_cs + carry.s * carry.s * v_ss
    out.cc, out.ss, out.v_cc, out.v_cs, out.v_ss, out.is_taut = cc, ss, v_cc, v_cs, v_ss, False
    return out


cdef inline Read read_hold(
    Staircases of, const double[:, :, :] readings, const unsigned char[:, ::1] mask, int j, Py_ssize_t i,
    double m, double p, Noise noise, double* left, double* other
) noexcept:
    """Filter one hold, on both sides of an edge where it is near one: `wirebayes.model.slack_holds`.

    What is left of the readings stands in `left`; `other` is room for as much.
    """
    cdef Dual* line = of.readings + j * of.width
    if not of.near[j]:
        return read_line(line, of.carry[j], of.width, readings, mask, j, i, m, p, noise, left)
    return read_sides(of, readings, mask, j, i, m, p, noise, left, other)


cdef Read read_sides(
    Staircases of, const double[:, :, :] readings, const unsigned char[:, ::1] mask, int j, Py_ssize_t i,
    double m, double p, Noise noise, double* left, double* other
) noexcept:
    """Filter one hold on both sides of its edge."""
    cdef Dual stretch = of.stretch[j]
    cdef Dual* line = of.taut + j * of.width
    cdef Read taut = read_line(line, of.taut_carry[j], of.width, readings, mask, j, i, m, p, noise, left), slack, out
    cdef double before = stretch.v + stretch.c * m, after, var, log_taut, log_slack, density, share
    cdef int r
    line = of.slack + j * of.width
    slack = read_line(line, of.slack_carry[j], of.width, readings, mask, j, i, m, p, noise, other)
    taut.mean += of.taut_carry[j].v
    slack.mean += of.slack_carry[j].v
    after = before + stretch.c * p * taut.pull_c + stretch.s * noise.q * taut.pull_s
    var = stretch.c * stretch.c * taut.v_cc + 2.0 * stretch.c * stretch.s * taut.v_cs + stretch.s * stretch.s * taut.v_ss
    log_taut = taut.log_density + log_normal_below(after / sqrt(fmax(var, LEAST_VARIANCE)))
    var = stretch.c * stretch.c * p + stretch.s * stretch.s * noise.q
    log_slack = slack.log_density + log_normal_below(-before / sqrt(fmax(var, LEAST_VARIANCE)))
    density = log_sum(log_taut, log_slack)
    share = exp(log_taut - density)
    out = taut
    out.is_taut = log_taut > log_slack
    if not out.is_taut:
        out = slack
        for r in range(of.width):
            left[r] = other[r]
    out.log_density = density
    out.mean = slack.mean + share * (taut.mean - slack.mean)
    out.var = share * taut.var + (1.0 - share) * slack.var + share * (1.0 - share) * (taut.mean - slack.mean) ** 2
    return out


def squares_gained(
    const double[:, ::1] drive, const double[:, ::1] reached, const double[:, ::1] shown,
    const Py_ssize_t[::1] which_end, const Py_ssize_t[::1] which_read, double kept
):
    """Squares (n,), summed over holds, of what creep gains in a hold, and of what a hold shows of that.

    `drive` (H, n) is where creep goes in each hold, `reached` (T, n) the share of it reached at its end, `shown` (P, n)
    between its readings; `which_end` and `which_read` (H,) of these. See `wirebayes.inference.coordinates.ridge`.
    """
    cdef Py_ssize_t n = drive.shape[1], holds = drive.shape[0], i, j
    if reached.shape[1] != n or shown.shape[1] != n or which_end.shape[0] != holds or which_read.shape[0] != holds:
        raise ValueError("drive, shares and holds are of different sizes")
    all_gained, all_shown, past = np.zeros(n), np.zeros(n), np.zeros(n)
    cdef double[::1] of_gained = all_gained, of_shown = all_shown, carried = past
    cdef double amount, gained, seen
    for j in range(holds):
        for i in range(n):
            amount = drive[j, i] - kept * carried[i]
            gained = amount * reached[which_end[j], i]
            seen = amount * shown[which_read[j], i]
            carried[i] += gained
            of_gained[i] += gained * gained
            of_shown[i] += seen * seen
    return all_gained, all_shown


cdef double LOG_2PI = log(2.0 * np.pi)


cdef int[:, ::1] counted(const double[:, :, :] readings, const unsigned char[:, ::1] mask, Py_ssize_t n):
    """How many readings each hold has, and which is the first of them; of the same readings or others in n columns."""
    cdef int j, r
    if readings.shape[0] != mask.shape[0] or readings.shape[1] != mask.shape[1] or readings.shape[2] not in (1, n):
        raise ValueError("readings, mask and columns are of different sizes")
    cdef int[:, ::1] found = np.zeros((2, mask.shape[0]), np.intc)
    for j in range(mask.shape[0]):
        for r in range(mask.shape[1] - 1, -1, -1):
            if mask[j, r]:
                found[0, j] += 1
                found[1, j] = r
    return found


cdef inline bint is_unseen(
    const double[:, :, :] readings, const int[:, ::1] counts, int j, Py_ssize_t i
) noexcept nogil:
    """Whether column `i` has no readings of a hold."""
    return not counts[0, j] or isnan(readings[j, counts[1, j], i if readings.shape[2] > 1 else 0])


def chain(
    Staircases of, const double[:, :, :] readings, const unsigned char[:, ::1] mask, const double[::1] variance,
    const double[::1] setting_sd, unsigned char[:, ::1] is_taut=None
):
    """Log densities (H, n), means and variances of the carried creep (H + 1, n): `wirebayes.model.likelihoods.chain`.

    Written into `is_taut` (H, n) is, near an edge, whether a taut wire is more probable than a slack one.
    """
    cdef int holds = mask.shape[0], j
    cdef Py_ssize_t n = variance.shape[0], i
    density, carried = np.zeros((holds, n)), np.zeros((2, holds + 1, n))
    cdef double[:, ::1] out = density
    cdef double[:, :, ::1] mv = carried
    cdef int[:, ::1] counts = counted(readings, mask, n)
    cdef double[:, ::1] left = np.empty((2, max(mask.shape[1], 1)))
    cdef double q, a, c
    cdef Read found
    cdef Noise noise
    for i in range(n):
        of.ask(i)
        q = setting_sd[i] * setting_sd[i]
        noise = Noise(1.0 / variance[i], log(variance[i]) + LOG_2PI, q)
        for j in range(holds):
            if not is_unseen(readings, counts, j, i):
                found = read_hold(
                    of, readings, mask, j, i, mv[0, j, i], mv[1, j, i], noise, &left[0, 0], &left[1, 0]
                )
                out[j, i], mv[0, j + 1, i], mv[1, j + 1, i] = found.log_density, found.mean, found.var
                if is_taut is not None:
                    is_taut[j, i] = found.is_taut
            else:
                a, c = of.carry[j].c, of.carry[j].s
                mv[0, j + 1, i] = a * mv[0, j, i]
                mv[1, j + 1, i] = a * a * mv[1, j, i] + c * c * q
    return density, carried[0], carried[1]


def standardised(
    Staircases of, const double[:, :, :] readings, const unsigned char[:, ::1] mask, const double[::1] variance,
    const double[::1] setting_sd
):
    """Log-likelihood (n,) and residuals (m, n): `wirebayes.model.likelihoods.standardised`."""
    cdef int holds = mask.shape[0], j, r, row = 0, count
    cdef Py_ssize_t n = variance.shape[0], i
    cdef int[:, ::1] counts = counted(readings, mask, n)
    for j in range(holds):
        row += counts[0, j] + 5 * (counts[0, j] > 0)
    total, residuals = np.zeros(n), np.empty((row, n))
    cdef double[::1] value = total
    cdef double[:, ::1] out = residuals, left = np.empty((2, max(mask.shape[1], 1)))
    cdef double q, a, c, m, p, scale, setting_sd_i
    cdef Read found
    cdef Noise noise
    for i in range(n):
        of.ask(i)
        setting_sd_i = fabs(setting_sd[i])
        q, m, p, row = setting_sd_i * setting_sd_i, 0.0, 0.0, 0
        noise = Noise(1.0 / variance[i], log(variance[i]) + LOG_2PI, q)
        scale = sqrt(noise.weight)
        for j in range(holds):
            count = counts[0, j]
            if is_unseen(readings, counts, j, i):
                a, c = of.carry[j].c, of.carry[j].s
                m, p = a * m, a * a * p + c * c * q
                if count:  # other columns have residuals there
                    out[row : row + count + 5, i] = 0.0
                    row += count + 5
                continue
            found = read_hold(of, readings, mask, j, i, m, p, noise, &left[0, 0], &left[1, 0])
            for r in range(count):
                out[row + r, i] = left[0, r] * scale
            row += count
            out[row, i], out[row + 1, i] = sqrt(p) * found.pull_c, setting_sd_i * found.pull_s
            out[row + 2, i] = 0.5 * sqrt(<double> count) * noise.log_variance
            out[row + 3, i], out[row + 4, i] = 0.5 * log_of_one_and(p * found.cc), 0.5 * log_of_one_and(q * found.ss)
            row += 5
            value[i] += found.log_density
            m, p = found.mean, found.var
    return total, residuals


def seen(
    const double[:, :, ::1] tension, const double[:, :, ::1] by_setting, const double[:, :, ::1] by_creep,
    const double[:, ::1] carry_by_setting, const double[:, ::1] carry_by_creep, const double[:, :, :] readings,
    const unsigned char[:, ::1] mask, const double[::1] variance, const double[::1] setting_sd,
    const double[:, ::1] carried_mean, const double[:, ::1] carried_var, const double[:, :, ::1] shapes
):
    """Inner products (n, k, k) and (n, k) of shapes that may be added: `wirebayes.model.likelihoods.seen`."""
    cdef int holds = mask.shape[0], j, r, f, g, k = shapes.shape[2]
    cdef Py_ssize_t n = variance.shape[0], i
    square, product = np.zeros((n, k, k)), np.zeros((n, k))
    # of each hold's shapes with each other, whatever the parameters
    own = np.einsum("hr,hrf,hrg->hfg", np.asarray(mask, float), shapes, shapes)
    cdef double[:, :, ::1] gram = square, each = own
    cdef double[:, ::1] along = product
    cdef int[:, ::1] counts = counted(readings, mask, n)
    cdef double[:, ::1] scratch = np.empty((6, max(k, 1)))
    cdef double[::1] mean = scratch[0], fc = scratch[1], fs = scratch[2], fr = scratch[3], pc = scratch[4], ps = scratch[5]
    cdef double weight, q, p, a, c, cc, cs, ss, cr, sr, det, v_cc, v_cs, v_ss, rest, by_c, by_s, shape, moved
    for i in range(n):
        weight, q = 1.0 / variance[i], setting_sd[i] * setting_sd[i]
        for f in range(k):
            mean[f] = 0.0  # of the carried creep, had the shapes been the readings
        for j in range(holds):
            a, c, p = carry_by_creep[j, i], carry_by_setting[j, i], carried_var[j, i]
            if not counts[0, j]:
                for f in range(k):
                    mean[f] *= a
                continue
            cc = cs = ss = cr = sr = 0.0
            for f in range(k):
                fc[f] = fs[f] = fr[f] = 0.0
            for r in range(mask.shape[1]):
                if mask[j, r]:
                    by_c, by_s = by_creep[j, r, i], by_setting[j, r, i]
                    rest = readings[j, r, i if readings.shape[2] > 1 else 0] - tension[j, r, i] - by_c * carried_mean[j, i]
                    cc += by_c * by_c
                    cs += by_c * by_s
                    ss += by_s * by_s
                    cr += by_c * rest
                    sr += by_s * rest
                    for f in range(k):
                        shape = shapes[j, r, f]
                        fc[f] += shape * by_c
                        fs[f] += shape * by_s
                        fr[f] += shape * rest
            cc, cs, ss, cr, sr = cc * weight, cs * weight, ss * weight, cr * weight, sr * weight
            det = 1.0 + p * cc + q * ss + p * q * fmax(cc * ss - cs * cs, 0.0)
            v_cc, v_cs, v_ss = p * (1.0 + q * ss) / det, -p * q * cs / det, q * (1.0 + p * cc) / det
            for f in range(k):
                # what is left of a shape beside the creep that it would have carried in
                fc[f] = fc[f] * weight - cc * mean[f]
                fs[f] = fs[f] * weight - cs * mean[f]
                fr[f] = fr[f] * weight - cr * mean[f]
                pc[f], ps[f] = v_cc * fc[f] + v_cs * fs[f], v_cs * fc[f] + v_ss * fs[f]
                along[i, f] += fr[f] - pc[f] * cr - ps[f] * sr
            for f in range(k):
                for g in range(f + 1):
                    moved = mean[f] * fc[g] + fc[f] * mean[g] + cc * mean[f] * mean[g]
                    gram[i, f, g] += each[j, f, g] * weight - moved - fc[f] * pc[g] - fs[f] * ps[g]
            for f in range(k):
                mean[f] = a * (mean[f] + pc[f]) + c * ps[f]
        for f in range(k):
            for g in range(f):
                gram[i, g, f] = gram[i, f, g]
    return square, product
