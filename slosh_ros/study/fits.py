"""What a fit of added mass tells of itself, as rows and as JSON."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slosh_ros.hydro.added_mass_files import describe
from slosh_ros.hydro.added_mass_tank import AddedMassTank
from slosh_ros.hydro.fit import YAW, FittedFamily


def told(tank: AddedMassTank) -> list[str]:
    """Say what was read, and what holds the fit against the liquid."""
    step = float(np.median(np.diff(tank.data.omega[np.isfinite(tank.data.omega)])))
    lines = [
        describe(tank.data),
        f'two modes of a family less than a step of its frequencies, {step:.2g} rad/s, apart come '
        'out as one',
    ]
    for fitted in tank.families:
        name = fitted.family.name
        if fitted.family is YAW:
            lines.append(f'{name}: off the fit by {fitted.noise:.1g} typically')
            continue
        mass = fitted.at_rest[0]
        lines.append(
            f'{name}: off the fit by {fitted.noise:.1g} typically; at rest the data tend to '
            f'{mass:.1f} kg, the liquid has {tank.data.density * tank.liquid.volume:.1f} kg; '
            f'constant terms {fitted.constants[0]:.5g} kg, {fitted.constants[1]:.5g} kg m, '
            f'{fitted.constants[2]:.5g} kg m^2, of which {fitted.above_band:.3g} kg m hang on '
            'modes above the band'
        )
    return lines


def rows(tank: AddedMassTank) -> Iterator[tuple[str, FittedFamily, int]]:
    """Name, family and number of every fitted mode, by family."""
    for fitted in tank.families:
        for n in range(len(fitted.omega)):
            yield f'{fitted.family.name}{n + 1}', fitted, n


def as_json(tank: AddedMassTank) -> dict[str, object]:
    """Return the fit for machines: SI, about O; errors are standard errors."""
    return {
        'file': tank.data.source,
        'reference': tank.data.reference.tolist(),
        'hydrostatic': tank.data.hydrostatic,
        'families': [
            {
                'name': fitted.family.name,
                'noise': fitted.noise,
                'at_rest': list(fitted.at_rest),
                'constants': fitted.constants.tolist(),
                'above_band': fitted.above_band,
            }
            for fitted in tank.families
        ],
        'modes': [
            {
                'name': name,
                'omega': float(fitted.omega[n]),
                'omega_error': float(fitted.omega_error[n]),
                'modal_mass': float(fitted.modal_mass[n]),
                'modal_mass_error': float(fitted.modal_mass_error[n]),
                'lever': float(fitted.lever[n]),
                'lever_error': float(fitted.lever_error[n]),
                'loss': float(fitted.loss[n]),
            }
            for name, fitted, n in rows(tank)
        ],
    }
