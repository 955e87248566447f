"""The robot as data: exit points, platform, legs, and the choices that are stated with it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Bools, Floats, Indices

Actuator = Literal["drum", "linear"]
Freedom = Literal["pose", "position", "orientation"]
Contact = Literal["table", "rail"]
Poses = tuple[Floats, Floats]  # positions and rotations, (3,) and (3, 3) of one, (n, 3) and (n, 3, 3) of several
Lengths = tuple[Floats, Floats]  # zero-tension lengths, and what lies beyond the exit points, (n, w) each
GRAVITY = 9.80665  # m/s^2, standard


@dataclass(frozen=True)
class GivenWire:
    """A wire whose parameters are written in the robot's file, without uncertainty.

    Attributes
    ----------
    parameters : dict
        ``k1`` (N), ``B`` (mm N^-U), ``U``, ``k2`` (s^-N), ``N``.
    length_mm : float
        The length that `B` refers to.
    """

    parameters: dict[str, float]
    length_mm: float


@dataclass(frozen=True)
class TensionRule:
    """The rule that chooses one of the many tensions of a redundant robot: stated in its file, and swappable."""

    choice: str
    lowest_N: float
    highest_N: float


@dataclass(frozen=True)
class Pulleys:
    """Swivelling pulleys at the exit points.

    Attributes
    ----------
    radius_m : (w,) array
        From the pulley's axle to the middle of the wire; 0 where the wire leaves from a fixed point.
    axis : (w, 3) array
        Unit vectors of the swivel axes, in the direction in which the wire runs when it comes to the exit point. The
        axis goes through the exit point and touches the rim there.
    """

    radius_m: Floats
    axis: Floats


@dataclass(frozen=True)
class Drums:
    """Drums of known size, which turn a motor's angle into wire.

    Attributes
    ----------
    radius_m : (w,) array
        From the drum's axle to the middle of the wire on the first layer; 0 where no drum is known.
    pitch_m : (w,) array
        Traverse of the wire in a turn.
    layer_turns, layer_m : (w,) arrays
        Turns in a layer, infinite where the wire lies in one layer; growth of the radius from layer to layer.
    wire_m : (w,) array
        Whole zero-tension length from its end on a layered drum to the platform; 0 where the wire lies in one layer.
    gear : (w,) array
        Turns of the motor for one of the drum.
    """

    radius_m: Floats
    pitch_m: Floats
    layer_turns: Floats
    layer_m: Floats
    wire_m: Floats
    gear: Floats


@dataclass(frozen=True)
class Plane:
    """A table, a wall or a rail that carries the platform, which moves in this plane only.

    Attributes
    ----------
    normal : (3,) array
        Unit vector from the plane to the platform's side; the plane goes through the home position.
    contact : {"table", "rail"}
        A table pushes the platform away from it only; a rail holds it both ways.
    friction : float
        Coulomb's coefficient between platform and plane.
    contact_radius_m : float
        Of the ring on which the platform slides; 0: of one point, whose friction resists no turn.
    """

    normal: Floats
    contact: Contact = "table"
    friction: float = 0.0
    contact_radius_m: float = 0.0


@dataclass(frozen=True)
class Robot:
    """A robot of ``w`` legs; all lengths in metres, masses in kilograms.

    Attributes
    ----------
    name, description, source : str
    freedom : {"pose", "position", "orientation"}
        "position": parallel lines keep the orientation, only the three coordinates are free. "orientation": a ball
        joint at the reference point, which is the home position, holds the platform both ways.
    mass_kg : float
    centre_of_mass_m : (3,) array
        In the platform's frame, from the reference point.
    exit_m, platform_m : (w, 3) arrays
        Exit points in the world, platform points in the platform's frame. Over a pulley the exit point is where the
        wire meets the rim.
    lines : (w,) array
        Parallel parts of one wire between exit and platform point; all carry its tension.
    beyond_m : (w,) array
        Wire beyond the exit point (to the drum or inside the pulley block); it stretches and creeps too.
    actuator : tuple of {"drum", "linear"}
    ratio : (w,) array
        Pulley block: wire moved per joint displacement; 0 for a drum.
    wire_m : (w,) array
        Total zero-tension length of a linear actuator's wire; 0 for a drum.
    wire : tuple of str
        Name of each leg's wire; legs of one name are cut from one line.
    given : dict of str to GivenWire
    rule : TensionRule
    home_m, home_rotation_rad : (3,) arrays
        The pose shown when none is requested.
    lower_m, upper_m : (3,) arrays
        Box in which workspace figures are computed.
    pulleys : Pulleys or None
        None where all wires leave from fixed points.
    drums : Drums or None
        None where the joint values are lengths and no motor angles are known.
    mass_kg_m : (w,) array or None
        Mass of each leg's wire by length; 0 where it is not given. It is not in the statics; `sag` says what it does.
    tension_bias_N : float
        Standard deviation of a tension sensor's bias, for calibration; 0: no bias.
    plane : Plane or None
        What carries the platform; None where it hangs on its wires alone.
    winch : (w,) int array or None
        Number of the winch that drives each leg, from 0 in the order of the legs; None where each has its own.
    joint_offset_m : (w,) array or None
        What a drum's zero-tension length is beyond the joint value; None where it is nothing.
    home_rotation_is_stated : bool
        Whether the robot's file states the home orientation; else it is level, or as balance leaves it.
    rotation_of_file_rad : (3,) array or None
        The home orientation that was stated, where `home_rotation_rad` is another one that hangs in balance.

    Examples
    --------
    >>> robot = wb.read_robot("hangprinter-4")
    >>> robot.legs, robot.freedom
    (4, 'position')
    """

    name: str
    description: str
    source: str
    freedom: Freedom
    mass_kg: float
    centre_of_mass_m: Floats
    exit_m: Floats
    platform_m: Floats
    lines: Floats
    beyond_m: Floats
    actuator: tuple[Actuator, ...]
    ratio: Floats
    wire_m: Floats
    wire: tuple[str, ...]
    given: dict[str, GivenWire]
    rule: TensionRule
    home_m: Floats
    home_rotation_rad: Floats
    lower_m: Floats
    upper_m: Floats
    pulleys: Pulleys | None = None
    drums: Drums | None = None
    tension_bias_N: float = 0.0
    mass_kg_m: Floats | None = None
    plane: Plane | None = None
    winch: Indices | None = None
    joint_offset_m: Floats | None = None
    home_rotation_is_stated: bool = True
    rotation_of_file_rad: Floats | None = None

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.exit_m)

    @property
    def joints(self) -> int:
        """Number of winches and linear actuators: of joint values."""
        return self.legs if self.winch is None else int(self.winch.max()) + 1

    @property
    def beyond_joint_m(self) -> Floats:
        """(w,) `joint_offset_m`, zeros where there is none."""
        return np.zeros(self.legs) if self.joint_offset_m is None else self.joint_offset_m

    @property
    def degrees(self) -> int:
        """Coordinates of a pose that are solved for: 6, or 3 when parallel lines keep the orientation."""
        return 3 if self.freedom == "position" else 6

    @property
    def freedoms(self) -> int:
        """Degrees of freedom that the platform really has: all, or those that a plane or a ball joint leaves."""
        if self.freedom == "orientation":
            return 3
        if self.plane is None:
            return self.degrees
        return 3 if self.freedom == "pose" else 2

    @cached_property
    def motions(self) -> Floats | None:
        """(d, d) Projection of small motions on those that a plane or a ball joint leaves; None where all are left.

        Along a plane and about its normal; about a ball joint, which is the reference point.
        """
        if self.freedom == "orientation":
            return np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        if self.plane is None:
            return None
        across = np.outer(self.plane.normal, self.plane.normal)
        out = np.zeros((self.degrees, self.degrees))
        out[:3, :3] = np.eye(3) - across
        out[3:, 3:] = across[: self.degrees - 3, : self.degrees - 3]
        return out

    @property
    def is_underactuated(self) -> bool:
        """Whether balance decides the orientation: a platform that may turn, on fewer wires than degrees of freedom."""
        return self.freedom == "pose" and self.legs < self.freedoms

    @property
    def is_on_given_wires(self) -> bool:
        """Whether the file gives the parameters of every leg's wire: then no test of a line changes the robot."""
        return all(name in self.given for name in self.wire)

    @property
    def is_linear(self) -> Bools:
        """(w,) True where a linear actuator drives the leg."""
        return np.array([a == "linear" for a in self.actuator])

    @cached_property
    def span_m(self) -> float:
        """Largest extent of the exit points along an axis: the robot's own measure of length."""
        return float(np.ptp(self.exit_m, axis=0).max())

    @cached_property
    def size_m(self) -> float:
        """Typical lever arm of the platform, by which rotations are compared with displacements."""
        arms = np.linalg.norm(self.platform_m - self.platform_m.mean(0), axis=1)
        return max(root_mean_square(arms), 1e-3 * self.span_m)

    @property
    def edge_scale(self) -> Floats:
        """(d,) What makes turns of metres at the platform's edge; 1 for displacements."""
        return np.where(np.arange(self.degrees) < 3, 1.0, 1.0 / self.size_m)
