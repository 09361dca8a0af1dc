"""Everything between two message conversions: configuration, sample gate, kinematics, engine."""

from slosh_ros.engine.config import SloshConfig
from slosh_ros.engine.convert import feed_message
from slosh_ros.engine.engine import SloshEngine
from slosh_ros.engine.gate import Verdict
from slosh_ros.engine.loads import Loads, LoadsBlock
from slosh_ros.engine.sample import MotionSample

__all__ = [
    'Loads',
    'LoadsBlock',
    'MotionSample',
    'SloshConfig',
    'SloshEngine',
    'Verdict',
    'feed_message',
]
