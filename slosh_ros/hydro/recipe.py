"""
The paper's own recipe: one mode from infinite frequency and an assumed shape (THEORY 6).

Section 4.1 takes a free surface f of known shape, so that eqs (10), (11) fix the ratio

    K = lambda/mu = (omega^2/g) int f x dS / int f^2 dS,

-4 L omega^2/(pi^2 g) for a cosine over the length L, -L omega^2/(2 g) for a plane, and reads
lambda^2/mu = -A_push and lambda lambda_turn/mu = -A_cross off the added mass at infinite frequency
less that of the liquid as a solid. What it gives is off for two reasons:

* at infinite frequency all modes speak, not the first alone: the modal mass comes out
  sum lambda^2/mu over the first, 14 % too great for Table 1's tank along and 6 % across;
* the frequency is that of the highest point on a grid of 0.1 rad/s, 1.05 for 1.0826: lambda goes
  with its inverse square, mu with its inverse fourth power.

The modal mass itself, hence the force, knows neither frequency nor shape: cosine and plane give
the same forces by construction. :mod:`slosh_ros.hydro.fit` has none of these errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.poles import SURGE, SWAY, Family
from slosh_ros.tank import LiquidAtRest

Shape = Literal['cosine', 'linear']


@dataclass(frozen=True)
class RecipeMode:
    """
    The one mode of the recipe.

    Attributes
    ----------
    omega : float
        Natural frequency [rad/s].
    mu : float
        Modal mass, eq (10) [kg].
    push : float
        lambda_1 of surge, lambda_2 of sway [kg].
    turn : float
        lambda_5 of surge, lambda_4 of sway [kg m].
    """

    omega: float
    mu: float
    push: float
    turn: float

    @property
    def ratio(self) -> float:
        """Return K = lambda/mu, the K_t of Table 1."""
        return self.push / self.mu


def recipe_mode(
    omega: float, push: float, cross: float, span: float, shape: Shape = 'cosine'
) -> RecipeMode:
    """
    Apply the recipe to numbers.

    Parameters
    ----------
    omega : float
        Frequency of the first peak [rad/s].
    push, cross : float
        A_11 [kg] and A_15 [kg m] (A_22 and A_24) at infinite frequency, less the solid liquid's.
    span : float
        Length (width) of the mean free surface [m].
    shape : str
        Assumed surface: `cosine` or `linear`.
    """
    moment = {'cosine': 4.0 / np.pi**2, 'linear': 0.5}[shape]
    ratio = -moment * span * omega**2 / GRAVITY
    return RecipeMode(omega, mu=-push / ratio**2, push=-push / ratio, turn=-cross / ratio)


def recipe_from_added_mass(
    data: AddedMass,
    liquid: LiquidAtRest,
    span: float,
    family: Family = SURGE,
    shape: Shape = 'cosine',
) -> RecipeMode:
    """
    Apply the recipe to added mass over frequency, as section 4.2 does.

    Parameters
    ----------
    data : AddedMass
        Its last row stands for infinite frequency, 50 rad/s in the paper.
    liquid : LiquidAtRest
        The liquid, for its mass and centroid.
    span : float
        Length (width) of the mean free surface [m].
    family : Family
        `SURGE` or `SWAY`.
    shape : str
        Assumed surface: `cosine` or `linear`.

    Raises
    ------
    InputError
        If |A| has no peak on the frequencies.
    """
    about_o = data.about_surface_centre(liquid.surface_inertia)
    mass = data.density * liquid.volume
    lever = float(liquid.centroid[2]) * (1.0 if family is not SWAY else -1.0)
    push = about_o.matrix[:, family.push, family.push] - mass
    cross = about_o.matrix[:, family.push, family.turn] - mass * lever
    height = np.abs(push)
    peaks = 1 + np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] > height[2:]))
    if not len(peaks):
        raise InputError(f'{data.source}: the added mass has no peak on its frequencies')
    first = float(data.omega[peaks[np.argmax(height[peaks])]])
    return recipe_mode(first, float(push[-1].real), float(cross[-1].real), span, shape)
