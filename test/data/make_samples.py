"""
Write the sample files of added mass beside this script.

Needs `pip install capytaine xarray netCDF4 h5py`. The body is an immersed half of a sphere, solved
by capytaine; its own exporters write `hemisphere.nc` and `hemisphere.1`. `hemisphere.h5` holds the
same numbers in the layout of WEC-Sim's BEMIO: there is no Python package that writes it.
"""

from __future__ import annotations

from pathlib import Path

import capytaine as cpt
import h5py
import numpy as np
from capytaine.io.wamit import export_to_wamit
from capytaine.io.xarray import export_dataset

HERE = Path(__file__).resolve().parent
RADIUS, DENSITY, GRAVITY = 1.0, 850.0, 9.81
OMEGA = [0.0, 1.0, 2.0, 3.0, np.inf]


def main() -> None:
    """Solve and write."""
    mesh = cpt.mesh_sphere(radius=RADIUS, resolution=(8, 8)).immersed_part()
    body = cpt.FloatingBody(
        mesh,
        dofs=cpt.rigid_body_dofs(rotation_center=(0.0, 0.0, -0.25)),
        name='hemisphere',
        center_of_mass=(0.0, 0.0, -0.375),
    )
    solver = cpt.BEMSolver()
    results = [
        solver.solve(
            cpt.RadiationProblem(body=body, radiating_dof=dof, omega=omega, rho=DENSITY, g=GRAVITY)
        )
        for omega in OMEGA
        for dof in body.dofs
    ]
    dataset = cpt.assemble_dataset(results, hydrostatics=False)
    del dataset.attrs['creation_of_dataset']
    export_dataset(HERE / 'hemisphere.nc', dataset)
    export_to_wamit(dataset, str(HERE / 'hemisphere'), exports=('1',))
    write_bemio(HERE / 'hemisphere.h5', dataset)


def write_bemio(path: Path, dataset) -> None:
    """Write what WEC-Sim's writeBEMIOH5 writes about radiation: A/rho, B/(rho omega)."""
    axes = ('influenced_dof', 'radiating_dof', 'omega')
    finite = dataset.sel(omega=[w for w in OMEGA if 0.0 < w < np.inf])
    omega = finite.omega.values
    added = finite.added_mass.transpose(*axes).values / DENSITY
    damping = finite.radiation_damping.transpose(*axes).values / (DENSITY * omega)
    infinite = dataset.added_mass.sel(omega=np.inf).transpose(*axes[:2]).values / DENSITY
    with h5py.File(path, 'w', track_order=False) as file:
        for name, value, unit in (
            ('simulation_parameters/scaled', [[0.0]], ''),
            ('simulation_parameters/g', [[GRAVITY]], 'm/s^2'),
            ('simulation_parameters/rho', [[DENSITY]], 'kg/m^3'),
            ('simulation_parameters/w', omega[:, np.newaxis], 'rad/s'),
            ('simulation_parameters/T', 2.0 * np.pi / omega[:, np.newaxis], 's'),
            ('body1/properties/cg', [[0.0], [0.0], [-0.25]], 'm'),
            ('body1/hydro_coeffs/added_mass/all', added, 'kg'),
            ('body1/hydro_coeffs/added_mass/inf_freq', infinite, 'kg'),
            ('body1/hydro_coeffs/radiation_damping/all', damping, 'N-s/m'),
        ):
            file.create_dataset(name, data=value, track_times=False).attrs['units'] = unit
        file['bem_data/code'] = 'CAPYTAINE'
        file['body1/properties/name'] = 'hemisphere'


if __name__ == '__main__':
    main()
