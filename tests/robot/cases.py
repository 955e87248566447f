"""Random (robot, pose, wire) cases: commanded poses, and lengths disturbed until wires go slack."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.robot.export.mujoco_model import mjcf
from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.joint_columns import POSITION, TURN
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import session_file

# shipped robots that hang on their wires alone: what no plane carries
HANGING = [name for name in schema.shipped() if schema.read_robot_file(name).plane is None]


def session_header(robot, given=()):
    """Columns of a session with poses and tensions, in the order of the docs."""
    hold, duration, *joints = session_file.columns(robot, given).required
    tensions = [f"tension_{i + 1}_N" for i in range(robot.legs)]
    return [hold, *POSITION, *TURN, duration, *joints, *tensions]


@dataclass
class Cases:
    wires: Wires
    position_m: np.ndarray
    rotation: np.ndarray
    zero_m: np.ndarray
    offset_m: np.ndarray


def commanded(robot, law, count, rng):
    """Feasible random poses with their exact lengths; wires stiff enough for the robot's mass."""
    position = rng.uniform(robot.lower_m, robot.upper_m, (count, 3))
    turn = rng.normal(0.0, 0.05, (count, 3)) if robot.degrees == 6 else np.zeros((count, 3))
    R = rotation.matrix(turn)
    tau = inverse.tensions(robot, position, R)
    good = np.isfinite(tau).all(1)
    position, R, tau = position[good], R[good], tau[good]
    k1 = np.exp(rng.uniform(np.log(50), np.log(1000), len(position))) * np.maximum(tau.max(1), robot.mass_kg)
    wires = Wires(law, "saturating", {"k1": k1[None]}, np.full((robot.legs, 1), 1000.0))
    commands = inverse.commands(robot, wires, position, R, tau)
    return Cases(wires, position, R, commands.zero_m, commands.offset_m)


def in_a_plane():
    """A weight on four wires of 5 m, 250 N each, in a plane: robot, k1, zero, offset, x, R."""
    exits = np.array([[3.0, 0.0, 4.0], [-3.0, 0.0, 4.0], [4.0, 0.0, 3.0], [-4.0, 0.0, 3.0]])
    robot = replace(
        schema.read_robot_file("hangprinter-4"), exit_m=exits, lines=np.ones(4), beyond_m=np.zeros(4), mass_kg=1.0
    )
    one_kg_N = -statics.weight(robot, np.eye(3)[..., None])[2, 0]
    robot = replace(robot, mass_kg=2 * 250.0 * (0.8 + 0.6) / one_kg_N)
    return robot, np.full(4, 1000.0), np.full(4, 4.0), np.zeros(4), np.zeros(3), np.eye(3)


def disturbed(robot, law, count, rng, amount=0.01):
    """The same with every length wrong by about a percent: redundant robots get slack wires."""
    cases = commanded(robot, law, count, rng)
    free = cases.zero_m - robot.beyond_m
    return replace(cases, zero_m=cases.zero_m + amount * free * rng.normal(size=free.shape))


def solved(robot, cases):
    """Forward kinematics from the commanded pose."""
    return forward.solve_equilibrium(robot, cases.wires, cases.zero_m, cases.offset_m, cases.position_m, cases.rotation)


def tensions_at_home(robot):
    """(1, w) tensions that hold the robot upright at its home."""
    return inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])


def softest(robot, cases, found):
    """(n,) smallest stiffness of solved poses, N/m; rotations count in metres at the platform's edge."""
    R = np.moveaxis(found.rotation, 0, -1)
    K = statics.stiffness(robot, cases.wires, found.position_m.T, R, cases.zero_m.T, cases.offset_m.T)
    return np.linalg.eigvalsh(K * np.outer(robot.edge_scale, robot.edge_scale))[:, 0]


def energy_minimum(robot, law, k1, zero_m, offset_m, start_m, start_rotation):
    """Pose of least energy by a general minimiser on an energy written anew, its gradient by a complex step."""
    from scipy.optimize import minimize

    size = robot.size_m
    d = robot.degrees

    def pose(q):
        if d == 3:
            return start_m + q, start_rotation.astype(complex)
        v = q[3:] / size
        angle2 = v @ v
        # cos and sinc as series of the squared angle, so that a complex step passes through zero
        a = sum((-1) ** k * angle2**k / float(_factorial(2 * k + 1)) for k in range(10))
        b = sum((-1) ** k * angle2**k / float(_factorial(2 * k + 2)) for k in range(10))
        K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        return start_m + q[:3], (np.eye(3) + a * K + b * K @ K) @ start_rotation

    def energy(q):
        x, R = pose(q)
        line = x + robot.platform_m @ R.T - robot.exit_m
        S = robot.lines * np.sqrt((line * line).sum(1)) + offset_m
        taut = S.real > zero_m
        hooke, modified = 0.5 * (S - zero_m) ** 2 / zero_m, S - zero_m - zero_m * np.log(S / zero_m)
        W = k1 * (hooke if law == "hooke" else modified)
        weight = robot.mass_kg * 9.80665 * (x + R @ robot.centre_of_mass_m)[2]
        return np.where(taut, W, 0.0).sum() + weight

    def value_and_slope(q):
        steps = 1e-30j * np.eye(d)
        return energy(q.astype(complex)).real, np.array([energy(q + s).imag / 1e-30 for s in steps])

    q = np.zeros(d)
    for _ in range(6):  # restarted: BFGS stops where rounding hides the energy's fall
        q = minimize(value_and_slope, q, jac=True, method="BFGS", options={"gtol": 1e-13, "maxiter": 400}).x
    q = _polished(value_and_slope, q)
    x, R = pose(q.astype(complex))
    return x.real, R.real, float(np.abs(value_and_slope(q)[1]).max())


def _polished(value_and_slope, q):
    """A few Newton steps on the slope with a difference Hessian: a root finder of its own."""
    for _ in range(4):
        g = value_and_slope(q)[1]
        H = np.array([(value_and_slope(q + e)[1] - value_and_slope(q - e)[1]) / 2e-6 for e in 1e-6 * np.eye(len(q))])
        q = q - np.linalg.lstsq(0.5 * (H + H.T), g, rcond=None)[0]
    return q


def _factorial(k):
    return float(np.prod(np.arange(1, k + 1, dtype=float)))


def with_pulleys(robot, rng, share=0.02):
    """The same robot with pulleys of about a share of its span at all exits but the first, their axes about upright."""
    from wirebayes.robot.mechanics.description import Pulleys

    axis = rng.normal(0.0, 0.3, (robot.legs, 3)) + [0.0, 0.0, 1.0]
    radius = share * robot.span_m * rng.uniform(0.5, 1.5, robot.legs)
    radius[0] = 0.0
    return replace(robot, pulleys=Pulleys(radius, axis / np.linalg.norm(axis, axis=1, keepdims=True)))


def wrench(robot, shape, tension_N):
    """(6 or 3, n) force and moment of the wires' tensions (w, n) on the platform, by virtual work."""
    return -(statics.jacobian(robot, shape) * (robot.lines[:, None] * tension_N)).sum(1)


def ball_joint(rng):
    """A mast on a ball joint, held upright by four to six wires that come from below."""
    legs = int(rng.integers(4, 7))
    turn = 2 * np.pi * (np.arange(legs) + rng.uniform(-0.2, 0.2, legs)) / legs
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(legs)])
    home = rng.normal(0.0, 1.0, 3)
    exits = home + (1.5 + 0.2 * rng.random(legs))[:, None] * ring + [0.0, 0.0, -0.2]
    across = (
        0.3 * np.column_stack([-ring[:, 1], ring[:, 0], ring[:, 2]]) * np.where(np.arange(legs) % 2, 1, -1)[:, None]
    )
    points = 0.3 * ring + across + np.array([0.0, 0.0, 1.0]) + 0.05 * rng.normal(size=(legs, 3))
    plain = schema.read_robot_file("sled-4")
    zeros = np.zeros(legs)
    return replace(
        plain, name="mast", freedom="orientation", plane=None, mass_kg=2.0, centre_of_mass_m=np.array([0.02, 0.0, 0.8]),
        exit_m=exits, platform_m=points, lines=np.ones(legs), beyond_m=zeros, actuator=("drum",) * legs, ratio=zeros,
        wire_m=zeros, wire=("default",) * legs, given={}, home_m=home, home_rotation_rad=np.zeros(3), lower_m=home,
        upper_m=home, rule=replace(plain.rule, lowest_N=5.0, highest_N=400.0), drums=None, pulleys=None,
    )  # fmt: skip


def rest_in_mujoco(robot, k1, zero_m, offset_m, start_m, start_rotation, softest_N_m, towards_m=None):
    """Where MuJoCo's damped platform comes to rest, and whether it does; the stiffness only sets the damping."""
    import mujoco

    stiffest = float((k1 * robot.lines**2 / zero_m).sum()) * 4
    fastest = np.sqrt(stiffest / robot.mass_kg)
    damping = 2.0 * float(np.sqrt(softest_N_m * robot.mass_kg))
    model = mujoco.MjModel.from_xml_string(
        mjcf(robot, k1, zero_m, offset_m, damping, 0.3 / float(fastest), towards_m=towards_m)
    )
    data = mujoco.MjData(model)
    data.qpos[:3] = start_m
    home = rotation.matrix(robot.home_rotation_rad)
    if robot.degrees == 6:
        turn = rotation.vector((home.T @ start_rotation)[None])[0]
        angle = float(np.linalg.norm(turn))
        data.qpos[3:7] = [np.cos(angle / 2), *(0.5 * np.sinc(angle / (2 * np.pi)) * turn)]
    calm = 0
    for _ in range(0, 400_000, 50):
        mujoco.mj_step(model, data, 50)
        calm = calm + 1 if np.abs(data.qvel).max() < 1e-11 * fastest else 0
        if calm == 3:
            break
    turned = np.eye(3)
    if robot.degrees == 6:
        flat = np.zeros(9)
        mujoco.mju_quat2Mat(flat, data.qpos[3:7])
        turned = home @ flat.reshape(3, 3)
    return np.array(data.qpos[:3]), turned, calm == 3
