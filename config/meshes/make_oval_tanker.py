"""Write oval_tanker.stl: an oval tank of 6.2 m with dished heads and a sump, in millimetres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

WIDTH, HEIGHT = 2.4, 1.7  # [m]
LENGTH, HEAD = 5.5, 0.35  # [m] of the straight part, and of each head
AROUND, ALONG, ACROSS = 32, 8, 6  # panels: half around, half the straight part, each head
SUMP = (0.5, 0.3, 0.15)  # [m] half length, half width and depth below the floor


def main() -> None:
    """Build a quarter, x > 0 and y > 0, and mirror it."""
    angle = np.pi * np.linspace(0.0, 1.0, AROUND + 1)  # from the lowest point
    straight = np.linspace(0.0, LENGTH / 2.0, ALONG + 1)
    turn = np.pi / 2.0 * np.linspace(0.0, 1.0, ACROSS + 1)[1:]
    x = np.append(straight, LENGTH / 2.0 + HEAD * np.sin(turn))
    share = np.append(np.ones_like(straight), np.cos(turn))
    share[-1] = 0.0
    y = WIDTH / 2.0 * np.outer(share, np.sin(angle))
    z = -HEIGHT / 2.0 * np.outer(share, np.cos(angle))
    y[:, [0, -1]] = 0.0
    # a smooth pit in the middle of the floor
    near = (x[:, np.newaxis] / SUMP[0]) ** 2 + (y / SUMP[1]) ** 2
    z -= np.where((near < 1.0) & (z < 0.0), SUMP[2] * (1.0 - near) ** 2, 0.0)
    grid = np.stack([np.broadcast_to(x[:, np.newaxis], y.shape), y, z], axis=-1)

    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    quarter = np.concatenate([np.stack([a, c, b], 2), np.stack([a, d, c], 2)]).reshape(-1, 3, 3)
    for axis in (0, 1):
        image = quarter.copy()
        image[..., axis] *= -1.0
        quarter = np.concatenate([quarter, image[:, ::-1]])
    areas = np.linalg.norm(
        np.cross(quarter[:, 1] - quarter[:, 0], quarter[:, 2] - quarter[:, 0]), axis=1
    )
    corners = np.round(1e3 * quarter[areas > 1e-9]).reshape(-1, 3) + np.array([3100, 0, 850])
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3))
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    mesh.export(Path(__file__).with_name('oval_tanker.stl'))


if __name__ == '__main__':
    main()
