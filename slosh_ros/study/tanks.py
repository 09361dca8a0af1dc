"""The liquids of slosh_node's tanks, as the trucks take them."""

from __future__ import annotations

from slosh_ros.engine import SloshConfig
from slosh_ros.vehicle import TankLiquid


def liquids_of(config: SloshConfig) -> list[TankLiquid]:
    """Solve for the liquids of all tanks of a configuration."""
    liquids = []
    for tank in config.tanks:
        c, pose = tank.coefficients(), tank.pose
        damping = tank.damping_ratio(c)
        liquids.append(TankLiquid.of(c, damping, pose.origin, pose.rotation, tank=tank.tank))
    return liquids
