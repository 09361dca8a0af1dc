"""
Trucks that carry liquid: parameters, roads, manoeuvres, simulation.

Two trucks. That of the paper's section 5 heaves and pitches, driving straight: a `Truck` on a
`Journey`, stepped by `TruckSimulator` or solved with its liquid by `simulate`, exactly. The other
moves in space and is steered: a `GeneralTruck` on a `Drive`, stepped by `GeneralSimulator` or
solved with its liquid by `simulate_general`. A simulator, a `SteppedTruck`, takes the sloshing
wrench from outside, step by step; a solution has truck and liquid as one system.
"""

from slosh_ros.vehicle.cargo import RigidCargo, SloshingCargo, TankLiquid
from slosh_ros.vehicle.closed_loop import ClosedLoopResult, CoupledSystem, simulate
from slosh_ros.vehicle.dynamics import Drive
from slosh_ros.vehicle.general_loop import simulate_general
from slosh_ros.vehicle.general_simulator import GeneralSimulator, SpatialPose
from slosh_ros.vehicle.general_truck import GeneralParameters, GeneralTruck
from slosh_ros.vehicle.history import History
from slosh_ros.vehicle.journey import Contact, Journey
from slosh_ros.vehicle.liquid import CALIBRATED_DAMPING_RATIO, TABLE_4, LiquidModes
from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import Bump, Profile, Road, random_road
from slosh_ros.vehicle.simulator import Pose, TruckSimulator
from slosh_ros.vehicle.stability import (
    LoadTransfer,
    StabilityFigures,
    StabilityWatch,
    SteadyTurn,
    Thresholds,
    Warn,
    load_transfer_ratio,
    rigid_threshold,
    steady_turn,
)
from slosh_ros.vehicle.steering import SineSteering, SteeringKnots
from slosh_ros.vehicle.stepped import Inertial, SteppedTruck, Twist
from slosh_ros.vehicle.truck import BASE_MOTION, Truck, TruckParameters

__all__ = [
    'BASE_MOTION',
    'CALIBRATED_DAMPING_RATIO',
    'TABLE_4',
    'Bump',
    'ClosedLoopResult',
    'Contact',
    'CoupledSystem',
    'Drive',
    'GeneralParameters',
    'GeneralSimulator',
    'GeneralTruck',
    'History',
    'Inertial',
    'Journey',
    'LiquidModes',
    'LoadTransfer',
    'Manoeuvre',
    'Pose',
    'Profile',
    'RigidCargo',
    'Road',
    'SineSteering',
    'SloshingCargo',
    'SpatialPose',
    'StabilityFigures',
    'StabilityWatch',
    'SteadyTurn',
    'SteeringKnots',
    'SteppedTruck',
    'TankLiquid',
    'Thresholds',
    'Truck',
    'TruckParameters',
    'TruckSimulator',
    'Twist',
    'Warn',
    'load_transfer_ratio',
    'random_road',
    'rigid_threshold',
    'simulate',
    'simulate_general',
    'steady_turn',
]
