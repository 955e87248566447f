"""A solver of its own: Euler angles, Newton on the wrench with slopes by complex steps, Radau's method in time."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

G = 9.80665


class Rig:
    """Statics of one robot under law (1) or (3), batched along the first axis; poses are x, y, z and three angles."""

    def __init__(self, robot, law, k1, rotation=None):
        self.robot, self.law = robot, law
        self.k1 = np.atleast_2d(k1)
        self.R0 = np.eye(3) if rotation is None else rotation
        self.d = 6 if robot.freedom == "pose" else 3
        self.span = np.linalg.norm(np.ptp(robot.exit_m, axis=0))
        self.edge = max(np.linalg.norm(robot.platform_m - robot.platform_m.mean(0), axis=1).max(), 0.05 * self.span)
        self.middle = robot.exit_m.mean(0)
        # the angles in metres at the edge, lengths in spans, so that the Jacobian is well scaled
        self.unit = np.array([self.span] * 3 + [self.span / self.edge] * 3)[: self.d]

    def start(self, position_m, n=1):
        q = np.zeros((n, self.d))
        q[:, :3] = (position_m - self.middle) / self.span
        return q

    def place(self, q):
        """Position and rotation of poses."""
        q = q * self.unit
        x = q[:, :3]
        if self.d == 3:
            return x, np.broadcast_to(self.R0, (len(q), 3, 3)).astype(q.dtype)
        a, b, c = q[:, 3], q[:, 4], q[:, 5]
        z, o = np.zeros_like(a), np.ones_like(a)
        matrix = lambda rows: np.stack([np.stack(r, -1) for r in rows], -2)  # noqa: E731
        Rx = matrix([[o, z, z], [z, np.cos(a), -np.sin(a)], [z, np.sin(a), np.cos(a)]])
        Ry = matrix([[np.cos(b), z, np.sin(b)], [z, o, z], [-np.sin(b), z, np.cos(b)]])
        Rz = matrix([[np.cos(c), -np.sin(c), z], [np.sin(c), np.cos(c), z], [z, z, o]])
        return x, Rz @ Ry @ Rx @ self.R0

    def _tension(self, q, zero, k1):
        x, R = self.place(q)
        arm = np.einsum("nij,wj->nwi", R, self.robot.platform_m)
        line = x[:, None] + arm - (self.robot.exit_m - self.middle)
        length = np.sqrt((line * line).sum(-1))
        S = self.robot.lines * length + self.robot.beyond_m
        strain = S / zero - 1 if self.law == "hooke" else 1 - zero / S
        return np.where(strain.real > 0, k1 * strain, 0.0), line / length[..., None], arm, R, S

    def tension(self, q, zero):
        return self._tension(q, zero, self.k1)[0].real

    def wrench(self, q, zero, k1=None):
        """Forces and moments over the edge, in weights."""
        weight = self.robot.mass_kg * G
        tau, u, arm, R, _ = self._tension(q, zero, self.k1 if k1 is None else k1)
        pull = -(self.robot.lines * tau)[..., None] * u / weight
        down = np.array([0, 0, -1.0])
        force = pull.sum(1) + down
        if self.d == 3:
            return force
        com = np.einsum("nij,j->ni", R, self.robot.centre_of_mass_m)
        moment = np.cross(arm, pull).sum(1) + np.cross(com, np.broadcast_to(down, com.shape))
        return np.concatenate([force, moment / self.edge], 1)

    def slope(self, q, zero, k1=None):
        h = 1e-30j * np.eye(self.d)
        return np.stack([self.wrench(q + e, zero, k1).imag / 1e-30 for e in h], -1)

    def softest(self, q, zero):
        """Smallest eigenvalue of the stiffness about small turns in the world's axes, ``(n,)``; below 0 it falls."""
        K = -self.slope(q, zero)
        if self.d == 6:
            b, c = (q * self.unit)[:, 4:].T
            z, o = np.zeros_like(b), np.ones_like(b)
            ez, ey = np.stack([z, z, o], -1), np.stack([-np.sin(c), np.cos(c), z], -1)
            ex = np.stack([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), -np.sin(b)], -1)
            K = K.copy()
            K[:, :, 3:] = K[:, :, 3:] @ np.linalg.inv(np.stack([ex, ey, ez], -1))
        return np.linalg.eigvalsh(0.5 * (K + np.swapaxes(K, 1, 2)))[:, 0]

    def newton(self, q, zero, steps=30):
        """Equilibria near starts, and which were found."""
        q, ok = np.array(q), np.zeros(len(q), bool)
        for _ in range(steps):
            live = np.flatnonzero(~ok)
            if not live.size:
                break
            k1 = self.k1[live] if len(self.k1) > 1 else self.k1
            f = self.wrench(q[live], zero[live], k1)
            J = self.slope(q[live], zero[live], k1)
            flat = np.abs(np.linalg.det(J)) < 1e-300
            J[flat] = np.eye(self.d)
            step = np.linalg.solve(J, -f[..., None])[..., 0]
            size = np.abs(step).max(1)
            step *= np.minimum(1.0, 0.02 / np.maximum(size, 1e-300))[:, None]
            q[live] += step
            ok[live] = (size < 1e-11) & ~flat
        return q, ok

    def zero_for(self, q, tau):
        """Lengths that give tensions at a pose."""
        S = self._tension(q, np.ones((len(q), self.robot.legs)), self.k1)[4].real
        return S / (1 + tau / self.k1) if self.law == "hooke" else S * (1 - tau / self.k1)


def least_tensions(robot, x, R):
    """Tensions of least norm within bounds by a general minimiser, in weights; None where it finds none."""
    arm = robot.platform_m @ R.T
    line = x + arm - robot.exit_m
    u = -line / np.linalg.norm(line, axis=1, keepdims=True) * robot.lines[:, None]
    A, load = u.T, np.array([0, 0, 1.0])
    if robot.freedom == "pose":
        A = np.vstack([A, np.cross(arm, u).T / np.abs(arm).max()])
        load = np.concatenate([load, -np.cross(R @ robot.centre_of_mass_m, [0, 0, -1.0]) / np.abs(arm).max()])
    keep = np.linalg.norm(A, axis=1) > 1e-12  # a plane has no balance across it
    A, load = A[keep], load[keep]
    low, high = robot.rule.lowest_N / (robot.mass_kg * G), robot.rule.highest_N / (robot.mass_kg * G)
    begin = np.clip(np.linalg.lstsq(A, load, rcond=None)[0], low, high)
    found = minimize(
        lambda t: t @ t,
        begin,
        jac=lambda t: 2 * t,
        method="SLSQP",
        bounds=[(low, high)] * robot.legs,
        options={"ftol": 1e-15, "maxiter": 500},
        constraints={"type": "eq", "fun": lambda t: A @ t - load, "jac": lambda t: A},
    )
    good = np.abs(A @ found.x - load).max() < 1e-7
    return found.x * robot.mass_kg * G if good else None


def drift(rig, theta, length_mm, zero, q, times_s):
    """Poses at times by a stiff integrator on creep, and the time of the fall (infinite without one).

    Every wire's creep g obeys dg/du = k2 (B tau^U - g) with u = t^N, the tension that of the pose at the time.
    """
    N = theta["N"]
    seen_g, seen_q = [np.zeros(rig.robot.legs)], [q[0]]

    def pose(g):
        # from the pose of the nearest creep that has one, whatever the integrator tried in between
        near = seen_q[int(np.abs(np.array(seen_g) - g).max(1).argmin())][None]
        there, ok = rig.newton(near, zero * (1 + g / length_mm))
        ok = ok & (np.abs(there - near).max(1) < 0.005) & (rig.softest(there, zero * (1 + g / length_mm)) > 0)
        if not ok[0]:
            return near, False
        seen_g.append(g[0])
        seen_q.append(there[0])
        return there, True

    def rate(u, g):
        here, _ = pose(g[None])
        tau = np.maximum(rig.tension(here, zero * (1 + g / length_mm)), 0.0)[0]
        return theta["k2"] * (theta["B"] * tau ** theta["U"] - g)

    def holds(u, g):
        return 1.0 if pose(g[None])[1] else -1.0

    holds.terminal = True
    scale = float(np.max(theta["B"] * rig.tension(q, zero) ** theta["U"]))
    u = np.asarray(times_s) ** N
    done = solve_ivp(
        rate,
        (0.0, u[-1]),
        np.zeros(rig.robot.legs),
        "Radau",
        u,
        events=holds,
        rtol=1e-5,
        atol=1e-8 * scale,
        first_step=1e-3 * u[-1],
    )
    out = []
    for g in np.reshape(done.y, (rig.robot.legs, -1)).T:
        out.append(pose(g[None])[0][0])
    fall = done.t_events[0][0] ** (1 / N) if len(done.t_events[0]) else np.inf
    return np.reshape(out, (-1, rig.d)), fall
