"""
The paper's tractor-semitrailer (section 5): parameters, road, manoeuvre, simulation.

`TruckSimulator` takes the sloshing wrench from outside, step by step; `simulate` solves truck and
liquid as one system. Both drive a `Truck` along a `Journey` (a `Manoeuvre` over a `Bump`).
"""

from slosh_ros.vehicle.closed_loop import ClosedLoopResult, CoupledSystem, simulate
from slosh_ros.vehicle.journey import Contact, Journey
from slosh_ros.vehicle.liquid import CALIBRATED_DAMPING_RATIO, TABLE_4, LiquidModes
from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import Bump
from slosh_ros.vehicle.simulator import Inertial, Pose, TruckSimulator, Twist
from slosh_ros.vehicle.truck import BASE_MOTION, Truck, TruckParameters

__all__ = [
    'BASE_MOTION',
    'CALIBRATED_DAMPING_RATIO',
    'TABLE_4',
    'Bump',
    'ClosedLoopResult',
    'Contact',
    'CoupledSystem',
    'Inertial',
    'Journey',
    'LiquidModes',
    'Manoeuvre',
    'Pose',
    'Truck',
    'TruckParameters',
    'TruckSimulator',
    'Twist',
    'simulate',
]
