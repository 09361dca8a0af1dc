"""
Write the sample file of a tank's added mass, `config/elliptical_tank.1`.

Needs `pip install capytaine xarray netCDF4`. The liquid fills the lower half of an elliptical
road tank. Capytaine gives the Rankine influence matrices of wall and mean free surface; with
normals out of the liquid (K - I) phi = S dphi/dn, dphi/dn = omega^2/g phi on the free surface and
the normal velocity of the six motions on the wall. Its exporter writes WAMIT's format; like WAMIT
with planes of symmetry, the file leaves out the entries that these make zero.
"""

from __future__ import annotations

from pathlib import Path

import capytaine as cpt
import numpy as np
from capytaine.bem.problems_and_results import RadiationResult
from capytaine.green_functions.delhommeau import Delhommeau
from capytaine.io.wamit import export_to_wamit

SAMPLE = Path(__file__).resolve().parents[2] / 'config' / 'elliptical_tank.1'
WIDTH, HEIGHT, LENGTH = 2.4, 1.8, 5.75  # of the tank [m]
DENSITY, GRAVITY = 850.0, 9.81
OMEGA = 0.1 * np.arange(1, 41)  # [rad/s]
COUPLED = {(k, k) for k in range(1, 7)} | {(1, 5), (5, 1), (2, 4), (4, 2)}
PANELS = 9  # from the lowest line to the contact line, or the axis to the end of the contour


def main() -> None:
    """Solve and write."""
    body, wall = liquid_body()
    problems = [
        cpt.RadiationProblem(body=body, radiating_dof=dof, omega=omega, rho=DENSITY, g=GRAVITY)
        for omega in OMEGA
        for dof in body.dofs
    ]
    nothing = dict.fromkeys(body.dofs, 0.0)
    dataset = cpt.assemble_dataset(
        [RadiationResult(problem, forces=nothing) for problem in problems], hydrostatics=False
    )
    axes = ('omega', 'influenced_dof', 'radiating_dof')
    order = {axis: list(body.dofs) for axis in axes[1:]}
    dataset = dataset.sel(omega=OMEGA, **order)
    dataset['added_mass'] = (axes, added_mass(body.mesh, wall))
    export_to_wamit(dataset, str(SAMPLE.with_suffix('')), exports=('1',))
    kept = [
        line
        for line in SAMPLE.read_text().splitlines()
        if tuple(map(int, line.split()[1:3])) in COUPLED
    ]
    SAMPLE.write_text('\n'.join(kept) + '\n')


def added_mass(mesh: cpt.Mesh, wall: int) -> np.ndarray:
    """Solve for the added mass at all frequencies, (n, 6, 6) [kg, kg m, kg m^2]."""
    single, double = Delhommeau().evaluate(
        mesh,
        mesh,
        free_surface=np.inf,
        water_depth=np.inf,
        wavenumber=0.0,
        adjoint_double_layer=False,
    )
    normal, centre = mesh.faces_normals[:wall], mesh.faces_centers[:wall]
    motion = np.hstack([normal, np.cross(centre, normal)])
    matrices = []
    for omega in OMEGA:
        system = double - np.eye(len(double))
        system[:, wall:] -= omega**2 / GRAVITY * single[:, wall:]
        potential = np.linalg.solve(system, single[:, :wall] @ motion)[:wall]
        weight = motion * mesh.faces_areas[:wall, np.newaxis]
        matrices.append(DENSITY * weight.T @ potential)
    return np.array(matrices)


def liquid_body() -> tuple[cpt.FloatingBody, int]:
    """Body of wall and free surface, finer towards the edges, and its number of wall panels."""
    along = graded(-LENGTH / 2.0, LENGTH / 2.0, 3 * PANELS)
    angle = graded(-np.pi / 2.0, np.pi / 2.0, 2 * PANELS)
    # chords cut off area: as much is added, so that the volume is right
    area = np.sum(np.sin(np.diff(angle))) / np.pi
    half, depth = (side / 2.0 / np.sqrt(area) for side in (WIDTH, HEIGHT))
    radial = np.sin(np.linspace(0.0, np.pi / 2.0, PANELS + 1))
    across = half * np.sin(np.linspace(-np.pi / 2.0, np.pi / 2.0, 2 * PANELS + 1))
    shell = patch(along, angle, lambda x, t: (x, half * np.sin(t), -depth * np.cos(t)))
    front = patch(
        radial,
        angle,
        lambda r, t: (LENGTH / 2.0, r * half * np.sin(t), -r * depth * np.cos(t)),
    )
    free = patch(along, across, lambda x, y: (x, y, 0.0))
    wall = np.concatenate([shell, front, front * [-1.0, 1.0, 1.0]])
    panels = np.concatenate([wall, free])
    normal = np.cross(panels[:, 2] - panels[:, 0], panels[:, 3] - panels[:, 1])
    outward = panels.mean(axis=1) - [0.0, 0.0, -depth / 2.0]
    inside_out = np.einsum('ij,ij->i', normal, outward) < 0.0
    panels[inside_out] = panels[inside_out, ::-1]
    mesh = cpt.Mesh(
        vertices=panels.reshape(-1, 3),
        faces=np.arange(4 * len(panels)).reshape(-1, 4),
        auto_check=False,
    )
    body = cpt.FloatingBody(
        mesh,
        dofs=cpt.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0)),
        name='liquid',
        center_of_mass=(0.0, 0.0, 0.0),
    )
    return body, len(wall)


def graded(begin: float, end: float, number: int) -> np.ndarray:
    """Places that lie closer at both ends."""
    return (begin + end - (end - begin) * np.cos(np.linspace(0.0, np.pi, number + 1))) / 2.0


def patch(u: np.ndarray, v: np.ndarray, point) -> np.ndarray:
    """Quadrilaterals of a surface over u and v, (n, 4, 3)."""
    grid = np.array([[point(a, b) for b in v] for a in u])
    corners = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


if __name__ == '__main__':
    main()
