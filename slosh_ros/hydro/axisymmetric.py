"""
Tank of revolution about the z axis by a problem in its meridian plane.

The modes that couple have one nodal diameter, phi = psi(r, z) (cos theta or sin theta). In the
half section r > 0, psi obeys

    psi_rr + psi_r/r + psi_zz - psi/r^2 = 0,
    dpsi/dn = 0 on the wall,  dpsi/dz = kappa psi on the free surface,

in weak form K psi = kappa S psi with the integrals of (psi_r v_r + psi_z v_z + psi v/r^2) r dr dz
and of psi v r dr. Stokes-Joukowski's potential of pitch is chi cos theta with K chi = b, where

    b = integral of [z (v_r + v/r) - r v_z] r dr dz;

that of roll is -chi sin theta, and nothing turns the liquid about its axis. The coupling with
pitch is rho pi (b . psi)/kappa by Green's identity (THEORY 1).

Functions and the map from the unit square are those of the section route: splines dense at the
contact line, where psi is singular as a power of the distance if the wall leans inwards. Those
that do not vanish on the axis are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, eigh, solve_triangular

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import (
    Array,
    ModalCoefficients,
    diametral_names,
    disc_points,
    peaks,
    still_coefficients,
)
from slosh_ros.hydro.section_mesh import Fan, HalfMesh, Resolution, Samples, gram
from slosh_ros.tank import LiquidAtRest, SymmetricSection

_SAMPLES = 2001  # of the radius, among which the largest |psi| is sought


def axisymmetric_coefficients(
    meridian: SymmetricSection,
    liquid: LiquidAtRest,
    density: float,
    modes: int,
    resolution: Resolution | None = None,
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    meridian : SymmetricSection
        Section of the tank by a plane through its axis.
    liquid : LiquidAtRest
        The liquid in it.
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes. The modes of a pair, `x1` and `y1`, `x3` and `y3`, ..., have the same
        frequency; of the last pair an odd number keeps only the surge mode.
    resolution : Resolution, optional
        Size of the discrete problem. The default grows with the modes and gives five digits or
        more of the lowest twelve, four of the last of many, and two of the wall friction in a
        nearly full tank.
    """
    count = (modes + 1) // 2
    default = Resolution(spans=max(26, 11 + 5 * count // 2), degree=7, fan_degree=14)
    f = _Functions(HalfMesh.of(meridian, liquid.depth, resolution or default))
    kappa, psi = f.steklov(count)
    radius = f.fan.radius

    samples = f.on_surface(radius * np.linspace(1.0, 0.0, _SAMPLES)) @ psi
    scale = -np.sign(samples[0]) / peaks(samples)  # positive at -x, where cos theta = -1
    psi = psi * scale

    square = np.einsum('ij,ij->j', psi, f.surface_mass @ psi)
    push, turn = f.surface_r @ psi, f.turn @ psi / kappa
    friction = np.einsum('ij,ij->j', psi, f.wall_energy @ psi) / (2.0 * kappa * square)
    across = density * np.pi * float(f.turn @ f.rotation)

    # the modes of a pair one after the other
    pair, sine = np.arange(modes) // 2, np.arange(modes) % 2 == 1
    coupling = np.zeros((modes, 6))
    coupling[~sine, 0], coupling[~sine, 4] = push[pair[~sine]], turn[pair[~sine]]
    coupling[sine, 1], coupling[sine, 3] = push[pair[sine]], -turn[pair[sine]]

    points = disc_points(radius)
    potentials = _Potentials(f, psi[:, pair], sine)
    return ModalCoefficients(
        route='axisymmetric',
        density=density,
        liquid=liquid,
        names=diametral_names(modes),
        omega=np.sqrt(GRAVITY * kappa[pair]),
        mu=density * np.pi * (square / kappa)[pair],  # eq (10)
        coupling=density * np.pi * coupling,  # eqs (11)-(14)
        inertia_stokes_joukowski=np.diag([across, across, 0.0]),
        wall_friction=friction[pair],
        surface_points=points,
        surface_shapes=potentials.surface(points),
        potentials=potentials,
        crests=(samples * scale)[np.newaxis, :, pair],
    )


def full_sphere(radius: float, liquid: LiquidAtRest, density: float) -> ModalCoefficients:
    """Coefficients, without modes, of a sphere full of liquid: it does not turn with the tank."""
    # about O, at the top, it moves with its centre
    across = density * liquid.volume * radius**2
    return still_coefficients(
        'axisymmetric', density, liquid, np.diag([across, across, 0.0]), _FullSphere(radius)
    )


@dataclass(frozen=True, eq=False)
class _FullSphere:
    """The liquid moves as its centre does, at z = -R."""

    radius: float

    def modes(self, points: Array) -> Array:
        """No potentials, shape (p, 0)."""
        return np.zeros((len(points), 0))

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        x, y, _ = points.T
        return np.stack([self.radius * y, -self.radius * x, np.zeros_like(x)], axis=-1)


class _Functions:
    """
    Functions v(r, z) on the meridian plane that vanish on the axis, and their integrals.

    Attributes
    ----------
    surface_mass : array, shape (n, n)
        S; the first m functions are those of the free surface.
    wall_energy : array, shape (n, n)
        Integrals along the wall of (v_s v_s + v v/r^2) r ds.
    surface_r : array, shape (n,)
        Integrals over the free surface of r v r dr.
    turn : array, shape (n,)
        b.
    rotation : array, shape (n,)
        chi, of Stokes-Joukowski's potential.
    """

    def __init__(self, mesh: HalfMesh) -> None:
        among = ~mesh.on_axis
        both = np.ix_(among, among)
        self.fan: Fan = mesh.fan
        self._among = among
        self._surface_count = int(np.count_nonzero(among[: mesh.fan.along.c.shape[1]]))

        def stiffness(s: Samples) -> Array:
            weight = s.weight * s.y
            return gram(s.v_y, weight) + gram(s.v_z, weight) + gram(s.v, s.weight / s.y)

        def turn(s: Samples) -> Array:
            weight = s.weight * s.y
            return (weight * s.z) @ s.v_y + (s.weight * s.z) @ s.v - (weight * s.y) @ s.v_z

        def wall_energy(s: Samples) -> Array:
            weight = s.wall_weight
            return gram(s.along_wall, weight * s.wall_y) + gram(s.wall, weight / s.wall_y)

        def surface_mass(s: Samples) -> Array:
            return gram(s.surface, s.surface_weight * s.surface_y)

        def surface_r(s: Samples) -> Array:
            return (s.surface_weight * s.surface_y**2) @ s.surface

        self.turn: Array = mesh.vector(turn)[among]
        self.wall_energy: Array = mesh.matrix(wall_energy)[both]
        self.surface_mass: Array = mesh.matrix(surface_mass)[both]
        self.surface_r: Array = mesh.vector(surface_r)[among]
        self._factor = cholesky(mesh.matrix(stiffness)[both], lower=True)
        self.rotation: Array = cho_solve((self._factor, True), self.turn)

    def steklov(self, count: int) -> tuple[Array, Array]:
        """Return the lowest kappa and psi by columns."""
        m = self._surface_count
        # with S = C C^T: C^T psi = kappa (C^T K^-1 C) (C^T psi)
        root = np.zeros((len(self.turn), m))
        root[:m] = cholesky(self.surface_mass[:m, :m], lower=True)
        half = solve_triangular(self._factor, root, lower=True)
        values, vectors = eigh(half.T @ half)
        lowest = half @ vectors[:, ::-1][:, :count]
        psi = solve_triangular(self._factor, lowest, lower=True, trans='T')
        return 1.0 / values[::-1][:count], psi

    def on_surface(self, r: Array) -> Array:
        """Values at places r of the free surface, shape (p, n)."""
        values = self.fan.along(1.0 - r / self.fan.radius)
        among = self._among[: values.shape[1]]
        return np.pad(values[:, among], ((0, 0), (0, len(self.turn) - self._surface_count)))

    def at(self, r: Array, z: Array) -> Array:
        """Values at points of the meridian plane, shape (p, n)."""
        return self.fan.values(np.stack([r, z], axis=-1))[:, self._among]


@dataclass(frozen=True, eq=False)
class _Potentials:
    """Odd in x or y, so that the means of Omega_4 and Omega_5 over the surface are zero."""

    functions: _Functions
    psi: Array
    sine: Array

    def modes(self, points: Array) -> Array:
        """Potentials phi_j of the modes, shape (p, n) [-]."""
        r, theta = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        return self._around(theta, self.functions.at(r, points[:, 2]))

    def surface(self, points: Array) -> Array:
        """Shapes f_j of the modes at points x, y of the free surface, shape (p, n) [-]."""
        r, theta = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        return self._around(theta, self.functions.on_surface(r))

    def _around(self, theta: Array, values: Array) -> Array:
        theta = theta[:, np.newaxis]
        around = np.where(self.sine, np.sin(theta), np.cos(theta))
        return np.asarray(around * (values @ self.psi))

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        x, y, z = points.T
        r = np.hypot(x, y)
        chi = self.functions.at(r, z) @ self.functions.rotation
        per_r = chi / np.where(r > 0.0, r, 1.0)
        return np.stack([-y * per_r, x * per_r, np.zeros_like(x)], axis=-1)
