"""
Tractor-semitrailer in the vertical plane: parameters, matrices, static loads.

Four degrees of freedom, `q = (z_t, theta_t, z_s, theta_s)`: heave and pitch of the tractor and
of the semitrailer, as deviations from the static equilibrium. Axes are REP-103 (x forward, y left,
z up), so a positive pitch is nose down. The liquid rides along as a frozen mass; its sloshing part
is added from outside (`slosh_ros.vehicle.simulator`, `slosh_ros.vehicle.closed_loop`).

The model is eq (38) of Han et al. (2019), derived anew from the Lagrangian: the printed equation
has several misprints, see `TruckParameters.paper_as_printed`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle.cargo import RigidCargo

Array = NDArray[np.float64]

Z_T, THETA_T, Z_S, THETA_S = range(4)
"""Positions of the degrees of freedom in `q`."""

BASE_MOTION: Array = np.zeros((6, 4))
"""Gamma (6, 4): motion (x, y, z, roll, pitch, yaw) of `base_link` per unit of `q`."""
BASE_MOTION[2, Z_S] = BASE_MOTION[4, THETA_S] = 1.0
BASE_MOTION.setflags(write=False)


@dataclass(frozen=True)
class TruckParameters:
    """
    Masses, springs and lengths of the tractor-semitrailer.

    `S` is the mass centre of the unladen semitrailer and the origin of `base_link`; `O` is
    the centre of the mean free surface of the liquid.

    Attributes
    ----------
    liquid_offset : float
        `l_l`, distance of the liquid's centroid ahead of S [m]. Not in the paper: assumed.
    liquid_height : float
        `d_l`, height of the liquid's centroid above S [m]. Not in the paper: assumed; 0.65 puts
        S at the bottom of the tank.
    liquid_pitch_inertia : float
        `I_lC`, pitch inertia of the frozen liquid about its centroid [kg m^2]. Not in the paper:
        assumed, that of a slender liquid body with a rigid lid.
    tractor_mass, semitrailer_mass : float
        `M_t` and (unladen) `M_s` [kg]. Table 3.
    liquid_mass : float
        `M_l` [kg]. Table 4; half full, although the table says 0.5 R.
    tractor_pitch_inertia, semitrailer_pitch_inertia : float
        `I_t` and (unladen) `I_s`, each about the body's own mass centre [kg m^2]. Table 3.
    axle_stiffness, axle_damping : float
        `k_w` [N/m] and `c_w` [N s/m] of each of the four axles. Table 3.
    hitch_stiffness, hitch_damping : float
        `k_bt` [N/m] and `c_bt` [N s/m] of the fifth wheel. Table 3.
    l_w1, l_w2 : float
        Axle 1 ahead of, axle 2 behind the tractor's mass centre [m]. Table 3.
    l_w3, l_w4 : float
        Axles 3 and 4 behind S [m]. Table 3.
    l_bt, l_bs : float
        Hitch behind the tractor's mass centre, and ahead of S [m]. Table 3.
    surface_height : float
        Height of O above the liquid's centroid [m]: `4 R / (3 pi)` for a half-full cylinder of
        R = 1.125 m.
    base_height : float
        Height of S above the road at rest [m]. Not in the paper: assumed; for display only.
    misprints : bool
        Use the matrices of eq (38) as printed.
    """

    liquid_offset: float
    liquid_height: float
    liquid_pitch_inertia: float
    tractor_mass: float = 4819.0
    semitrailer_mass: float = 6400.0
    liquid_mass: float = 27832.55
    tractor_pitch_inertia: float = 10220.0
    semitrailer_pitch_inertia: float = 36854.0
    axle_stiffness: float = 5e5
    axle_damping: float = 1e4
    hitch_stiffness: float = 1e5
    hitch_damping: float = 1e3
    l_w1: float = 2.3
    l_w2: float = 2.9
    l_w3: float = 2.206
    l_w4: float = 3.516
    l_bt: float = 2.3
    l_bs: float = 8.494
    surface_height: float = 4.0 * 1.125 / (3.0 * np.pi)
    base_height: float = 1.25
    misprints: bool = False

    @classmethod
    def corrected(cls) -> TruckParameters:
        """Give the reference truck: Table 3 and the three assumptions of the class."""
        return cls(liquid_offset=0.0, liquid_height=0.65, liquid_pitch_inertia=457050.0)

    @classmethod
    def paper_as_printed(cls) -> TruckParameters:
        """
        Give the truck of eq (38) to the letter, which is unstable and only kept to show it.

        Against `corrected`, and counted as in the derivation: (M1) `l_w1**2` has the wrong sign
        in the tractor's pitch row; (M2) a stiffness stands in the damping of the semitrailer's
        pitch row; (M3) `l_w3` stands where `l_w4` belongs; (M6) `lambda_5`, known about O,
        is used with the motion of S; (M7-M9) the parallel-axis and gravity terms of the liquid
        are missing. Terms the text merely repeats are taken once.
        """
        return cls(
            liquid_offset=0.0, liquid_height=0.65, liquid_pitch_inertia=457050.0, misprints=True
        )

    @classmethod
    def calibrated(cls) -> TruckParameters:
        """
        Give one truck whose peak forces are the paper's 25.1, 21.2 and 26.6 kN.

        A calibration, not evidence: three numbers fitted with four unknowns (the fourth is
        `slosh_ros.vehicle.liquid.CALIBRATED_DAMPING_RATIO`), and other quite different choices
        fit as well.
        """
        return cls(liquid_offset=0.425, liquid_height=0.656, liquid_pitch_inertia=457e3)

    @property
    def wheel_offsets(self) -> Array:
        """
        Distances (4,) of the axles behind axle 1 [m].

        15.3 and 16.61 m for axles 3 and 4; Table 3 prints 12.3 and 13.61 m, which contradicts its
        own lengths and the wheel times of the text.
        """
        hitch = self.l_w1 + self.l_bt + self.l_bs
        return np.array([0.0, self.l_w1 + self.l_w2, hitch + self.l_w3, hitch + self.l_w4])

    @property
    def base_position(self) -> Array:
        """Position (3,) of `base_link` at rest, from the road under axle 1 [m]."""
        return np.array([-(self.l_w1 + self.l_bt + self.l_bs), 0.0, self.base_height])

    @property
    def liquid_centroid(self) -> Array:
        """Position (3,) of the liquid's centroid in `base_link` [m]."""
        return np.array([self.liquid_offset, 0.0, self.liquid_height])

    @property
    def liquid_origin(self) -> Array:
        """Position (3,) of O in `base_link` [m]; the axes at O are parallel to it."""
        height = 0.0 if self.misprints else self.liquid_height + self.surface_height  # M6
        return np.array([self.liquid_offset, 0.0, height])


@dataclass(frozen=True)
class Truck:
    """
    The matrices of `M q'' + C q' + K q = P r + B_a a + Gamma^T W`.

    `r = k_w z_w + c_w z_w'` (4,) are the forces by which the road, at height `z_w` under each
    axle, pushes [N]; `a` is the longitudinal acceleration [m/s^2]; `W` (6,) is what the
    sloshing liquid adds, at `base_link` [N, N m].

    Attributes
    ----------
    parameters : TruckParameters
        Where the numbers come from.
    """

    parameters: TruckParameters

    @property
    def base_motion(self) -> Array:
        """Gamma (6, 4): `BASE_MOTION`."""
        return BASE_MOTION

    @cached_property
    def cargo(self) -> RigidCargo:
        """The frozen liquid; only its pitch inertia matters, the others are for a cylinder's."""
        p = self.parameters
        roll, _, yaw = np.diag(RigidCargo.half_full().inertia).tolist()
        x, _, z = p.liquid_centroid.tolist()
        return RigidCargo.principal(
            p.liquid_mass, (x, 0.0, z), (roll, p.liquid_pitch_inertia, yaw)
        )

    @cached_property
    def mass(self) -> Array:
        """M (4, 4), the liquid frozen [kg, kg m, kg m^2]."""
        p = self.parameters
        d, length = p.liquid_height, p.liquid_offset
        laden = p.semitrailer_mass + p.liquid_mass
        inertia = p.semitrailer_pitch_inertia + p.liquid_pitch_inertia
        matrix = np.diag([p.tractor_mass, p.tractor_pitch_inertia, laden, inertia])
        if not p.misprints:  # M7, M8
            matrix[THETA_S, THETA_S] += p.liquid_mass * (d**2 + length**2)
            matrix[Z_S, THETA_S] = matrix[THETA_S, Z_S] = -p.liquid_mass * length
        return matrix

    @cached_property
    def damping(self) -> Array:
        """C (4, 4) [N s/m, N s, N m s]."""
        p = self.parameters
        matrix = self._suspension(p.axle_damping, p.hitch_damping)
        if p.misprints:
            matrix[THETA_S, Z_S] += (p.axle_stiffness - p.axle_damping) * p.l_w3  # M2
        return matrix

    @cached_property
    def stiffness(self) -> Array:
        """K (4, 4), gravity on the frozen liquid included [N/m, N, N m]."""
        p = self.parameters
        matrix = self._suspension(p.axle_stiffness, p.hitch_stiffness)
        if not p.misprints:  # M9: a centroid above S tips over
            matrix[THETA_S, THETA_S] -= p.liquid_mass * GRAVITY * p.liquid_height
        return matrix

    @cached_property
    def axle_motion(self) -> Array:
        """P (4, 4): column i is the rise of the body over axle i per unit of `q`."""
        p = self.parameters
        return np.array(
            [
                [1.0, 1.0, 0.0, 0.0],
                [-p.l_w1, p.l_w2, 0.0, 0.0],
                [0.0, 0.0, 1.0, 1.0],
                [0.0, 0.0, p.l_w3, p.l_w4],
            ]
        )

    @property
    def road_stiffness(self) -> Array:
        """B_z (4, 4): force per unit of road height under each axle [N/m, N]."""
        return self.parameters.axle_stiffness * self.axle_motion

    @property
    def road_damping(self) -> Array:
        """B_v (4, 4): force per unit rate of road height under each axle [N s/m, N s]."""
        return self.parameters.axle_damping * self.axle_motion

    @property
    def surge(self) -> Array:
        """B_a (4,): force per unit of longitudinal acceleration [kg, kg m]."""
        p = self.parameters
        return np.array([0.0, 0.0, 0.0, -p.liquid_mass * p.liquid_height])

    @cached_property
    def forcing(self) -> Array:
        """[P, B_a] (4, 5): force per unit of the journey's inputs `(r_1 .. r_4, a)`."""
        return np.column_stack([self.axle_motion, self.surge])

    @cached_property
    def static_axle_loads(self) -> Array:
        """
        Give the loads (4,) of the axles on the road at rest, with a solid cargo [N].

        The cargo is solid because the liquid would re-level in the 3.8 degrees nose-down tilt
        that the soft hitch of Table 3 gives, to 7.4 degrees: no real loaded truck stands so.
        """
        p = self.parameters
        weight = -GRAVITY * np.array(
            [
                p.tractor_mass,
                0.0,
                p.semitrailer_mass + p.liquid_mass,
                -p.liquid_mass * p.liquid_offset,
            ]
        )
        settled = np.linalg.solve(self.stiffness, weight)
        return np.asarray(-p.axle_stiffness * self.axle_motion.T @ settled)

    def axle_loads(self, road_force: Array, q: Array, rate: Array) -> Array:
        """
        Give the loads of the axles on the road; negative where a real wheel would lift off.

        Parameters
        ----------
        road_force : array, shape (..., 4)
            `k_w z_w + c_w z_w'` per axle [N].
        q, rate : array, shape (..., 4)
            Deviations and their rates.

        Returns
        -------
        array, shape (..., 4)
            Vertical loads [N].
        """
        p = self.parameters
        body = (p.axle_stiffness * q + p.axle_damping * rate) @ self.axle_motion
        return np.asarray(self.static_axle_loads + road_force - body)

    def _suspension(self, axle: float, hitch: float) -> Array:
        """Sum the axles' and the hitch's springs (or dampers): eq (38), mended."""
        p = self.parameters
        stretch = np.array([1.0, p.l_bt, -1.0, p.l_bs])
        matrix = axle * (self.axle_motion @ self.axle_motion.T) + hitch * np.outer(
            stretch, stretch
        )
        if p.misprints:
            matrix[THETA_T, THETA_T] -= 2.0 * axle * p.l_w1**2  # M1
            matrix[THETA_S, Z_S] += axle * (p.l_w3 - p.l_w4)  # M3
            matrix[THETA_S, THETA_S] += axle * (p.l_w3**2 - p.l_w4**2)  # M3
        return np.asarray(matrix)
