"""
How close a vehicle is to rolling over, from its motion and the sloshing wrench alone.

Moments are taken in the roll plane: x forward, y left, z up, positive roll lifts the left side.
All that moves with `base_link` loads its suspension with a lateral force Y and a roll moment X:
weight and inertia of vehicle and frozen liquid, which are linear in the specific force s and the
angular acceleration alpha of `base_link`, and the sloshing wrench W,

    (Y, X) = R (s, alpha) + W,                                                              (1)

R being constant; of a point mass m at the height z_c above `base_link`, for instance,
`Y = -m (s_y - z_c alpha_x)` and `X = -z_c Y`. The specific force is what an IMU measures. If the
body leans by phi against the road it holds, beside the lateral acceleration a_y, the weight that
leaning brings to bear, `s_y = a_y + g phi`: so the compliance of springs and tyres is in the
measurement, to first order, and so is the bank of a road. The springs hold the moment about the
roll axis, at the height h_r above the road, where `base_link` is at h_b:

    X_r = X + (h_r - h_b) Y,        phi = X_r / K.                                          (2)

On the road act the springs' moment and, at the height of the roll axis, the side force in road
axes, `Y + phi m g`. They balance the wheels on either side of the track T:

    (F_R - F_L) T / 2 = X_r - h_r (Y + phi m g),        F_R + F_L = m g.                    (3)

K enters by `h_r phi m g` only, the weight's place over a track that does not lean with the body:
for h_r = 0, (3) is `X - h_b Y`, the loads moved to the road. In a steady turn X_r is in
proportion to s_y, `X_r = k s_y`, and (2), (3) give

    LTR = (F_R - F_L) / (F_R + F_L) = a_y / a_*,
    a_* = g m (T / 2) / (k / (1 - g k / K) + m h_r),                                        (4)

with the k of a frozen liquid, or of one that has settled with its surface square to s.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.modal.loads import cross_matrix, rigid_matrix
from slosh_ros.parameters import Parameter, Values, read_parameter_file, resolved
from slosh_ros.vehicle.general_truck import GeneralTruck

Array = NDArray[np.float64]

GROUP = 'vehicle.'
"""Beginning of the names of the parameters."""
_ROWS = (
    Parameter(
        'vehicle.mass', 'double', None, 'of the vehicle with empty tanks', 'kg', 1.0, 1e6
    ),
    Parameter(
        'vehicle.mass_centre', 'double[3]', None,
        'mass centre of the vehicle with empty tanks, in base_link; a tractor counts as if above '
        'its fifth wheel', 'm', -1e3, 1e3,
    ),
    Parameter(
        'vehicle.roll_inertia', 'double', None,
        'of the vehicle with empty tanks, about x through its mass centre', 'kg m^2', 0.0, 1e7,
    ),
    Parameter(
        'vehicle.base_height', 'double', None, 'of base_link above the road, laden', 'm',
        -10.0, 10.0,
    ),
    Parameter(
        'vehicle.track', 'double', None,
        'distance between left and right tyres, the mean of the axles by load', 'm', 0.1, 10.0,
    ),
    Parameter(
        'vehicle.roll_axis', 'double', None,
        'height above the road of the axis that the body rolls about', 'm', -10.0, 10.0,
    ),
    Parameter(
        'vehicle.roll_stiffness', 'double', None,
        'of suspension and tyres: moment about the roll axis per angle', 'N m/rad', 1.0, 1e12,
    ),
    Parameter(
        'vehicle.least_margin', 'double', 0.1,
        'rollover margin below which rollover_node warns', 'g', 0.0, 10.0,
    ),
)  # fmt: skip
PARAMETERS: dict[str, Parameter] = {row.name: row for row in _ROWS}
"""The one table of parameters of the vehicle: rollover_node, `slosh replay --rollover`."""


@dataclass(frozen=True)
class RollVehicle:
    """
    What one must know of a vehicle to judge how close it is to rolling over.

    Attributes
    ----------
    mass : float
        With empty tanks [kg].
    mass_centre : tuple of float, length 3
        Mass centre with empty tanks, in `base_link` [m].
    roll_inertia : float
        About x through the mass centre [kg m^2].
    base_height : float
        Of `base_link` above the road, h_b [m].
    track : float
        T [m].
    roll_axis : float
        Height of the roll axis above the road, h_r [m].
    roll_stiffness : float
        K [N m/rad].
    least_margin : float
        Margin below which somebody should be told [g].
    """

    mass: float
    mass_centre: tuple[float, float, float]
    roll_inertia: float
    base_height: float
    track: float
    roll_axis: float
    roll_stiffness: float
    least_margin: float = 0.1

    @classmethod
    def of(cls, truck: GeneralTruck) -> RollVehicle:
        """
        Condense a tractor-semitrailer to what moves with the semitrailer.

        The fifth wheel is the foremost point that does, so the tractor counts as being there. The
        tractor's suspension helps through the torsion of the fifth wheel.
        """
        p = truck.parameters
        masses = np.array([p.tractor_mass, p.semitrailer_mass])
        x, z = np.array([[p.l_bs, 0.0], [p.tractor_height - p.semitrailer_height, 0.0]])
        share = masses / masses.sum()
        centre = (float(share @ x), 0.0, float(share @ z))
        about_x = p.tractor_inertia[0] + p.semitrailer_inertia[0]
        loads = truck.static_wheel_loads.sum(axis=1)
        heights = np.repeat([p.tractor_roll_axis, p.semitrailer_roll_axis], 2)
        axles = p.axle_stiffness * np.array(p.spring_base) ** 2 + np.array(p.anti_roll_stiffness)
        tractor, bogie = axles.reshape(2, 2).sum(axis=1).tolist()
        twist = p.hitch_roll_stiffness
        return cls(
            mass=float(masses.sum()),
            mass_centre=centre,
            roll_inertia=about_x + float(masses @ (z - centre[2]) ** 2),
            base_height=p.semitrailer_height,
            track=float(loads @ np.array(p.track) / loads.sum()),
            roll_axis=float(loads @ heights / loads.sum()),
            roll_stiffness=bogie + tractor * twist / (tractor + twist),
        )

    @classmethod
    def from_file(cls, path: Path) -> RollVehicle:
        """
        Read the section of rollover_node in a ROS 2 parameter file.

        Raises
        ------
        InputError
            If the file cannot be read or a parameter does not fit; the message names both.
        """
        try:
            return cls.from_values(
                resolved(PARAMETERS, read_parameter_file(path, 'rollover_node'))
            )
        except InputError as error:
            raise InputError(f'{path}: {error}') from error

    @classmethod
    def from_values(cls, values: Values) -> RollVehicle:
        """
        Take checked parameters.

        Raises
        ------
        InputError
            If one is missing.
        """
        missing = [name for name in PARAMETERS if name not in values]
        if missing:
            raise InputError(
                f'{", ".join(missing)} missing; see config/rollover.yaml for what it takes'
            )
        x, y, z = values.vector('vehicle.mass_centre').tolist()
        numbers = {
            name.removeprefix(GROUP): values.number(name)
            for name in PARAMETERS
            if name != 'vehicle.mass_centre'
        }
        return cls(mass_centre=(x, y, z), **numbers)


class Rollover(NamedTuple):
    """
    The vehicle at one instant, or at many: numbers or arrays of one shape.

    Attributes
    ----------
    load_transfer_ratio : array
        (F_R - F_L) / (F_R + F_L) of all wheels: 0 is even, +1 all on the right, in a left turn;
        beyond one a side has lifted off [-].
    settled : array
        Load transfer ratio that the present lateral acceleration leads to, once vehicle and
        liquid have come to rest in it [-].
    margin : array
        Lateral acceleration that may come on top of the present one, to the loaded side, before
        that side carries all: the vehicle settling, the liquid staying where it is [g].
    """

    load_transfer_ratio: Array
    settled: Array
    margin: Array


FIGURES = ('load_transfer_ratio', 'load_transfer_ratio_settled', 'rollover_margin')
"""Names of the topics of rollover_node, in the order of `Rollover`."""


class RollBalance:
    """
    Moments of a laden vehicle in the roll plane.

    Parameters
    ----------
    vehicle : RollVehicle
        The vehicle with empty tanks.
    liquid : array, shape (6, 6)
        Weight and inertia of the liquid: wrench at `base_link` per acceleration (s, alpha).
    settled : array, shape (6, 3)
        Sloshing wrench at `base_link` per constant specific force.

    Raises
    ------
    InputError
        If the laden vehicle cannot stand on its springs.

    Attributes
    ----------
    vehicle : RollVehicle
        As given.
    threshold_solid, threshold_liquid : float
        Lateral acceleration at which an evenly laden vehicle rolls over in a steady turn, the
        liquid frozen and settled, eq. (4) [m/s^2].
    """

    def __init__(self, vehicle: RollVehicle, liquid: Array, settled: Array) -> None:
        v = self.vehicle = vehicle
        centre = np.array(v.mass_centre)
        about_origin = -v.mass * cross_matrix(centre) @ cross_matrix(centre)
        about_origin[0, 0] += v.roll_inertia
        whole = liquid + rigid_matrix(v.mass, centre, about_origin)
        self._load = whole[[1, 3]].T  # Y and X per acceleration
        self._mass = -float(whole[1, 1])
        self._lift = self._mass * GRAVITY * v.track / 2.0  # moment of the weight about a wheel
        self._drop = v.roll_axis - v.base_height
        at_rest = whole[:, :3] + settled
        # k and, of an uneven load, the same of s_z. A rigid body's matrix is symmetric: its force
        # row tells k without the liquid that `liquid` may already count as settled
        free, uneven = (at_rest[3] + self._drop * at_rest[1])[1:].tolist()
        frozen = float(whole[1, 3] + self._drop * whole[1, 1])
        self.threshold_solid, self.threshold_liquid = (self._threshold(k) for k in (frozen, free))
        self._uneven = GRAVITY * uneven * self._leaning(free) / self._lift

    def judge(self, acceleration: Array, slosh: Array) -> Rollover:
        """
        Balance the moments, eqs (1)-(4).

        Parameters
        ----------
        acceleration : array, shape (..., 6)
            Specific force [m/s^2] and angular acceleration [rad/s^2] of `base_link`.
        slosh : array, shape (..., 6)
            Sloshing wrench at `base_link` [N, N m]; zero for a solid load.
        """
        v, weight = self.vehicle, self._mass * GRAVITY
        carried = acceleration @ self._load
        side, roll = np.moveaxis(carried + slosh[..., [1, 3]], -1, 0)
        about_axis = roll + self._drop * side
        lean = about_axis / v.roll_stiffness
        ratio = (about_axis - v.roll_axis * (side + lean * weight)) / self._lift
        lateral = -carried[..., 0] / self._mass - GRAVITY * lean
        return Rollover(
            load_transfer_ratio=ratio,
            settled=self._uneven + lateral / self.threshold_liquid,
            margin=(1.0 - np.abs(ratio)) * self.threshold_solid / GRAVITY,
        )

    def _leaning(self, moment: float) -> float:
        """How much further leaning goes by the weight that it brings to bear."""
        left = 1.0 - GRAVITY * moment / self.vehicle.roll_stiffness
        if left <= 0.0:
            raise InputError(
                f'vehicle.roll_stiffness is {self.vehicle.roll_stiffness:.4g} N m/rad, with which '
                f'the laden vehicle falls over at rest; it needs more than {GRAVITY * moment:.4g}'
            )
        return 1.0 / left

    def _threshold(self, moment: float) -> float:
        arm = moment * self._leaning(moment) + self.vehicle.roll_axis * self._mass
        return self._lift / arm
