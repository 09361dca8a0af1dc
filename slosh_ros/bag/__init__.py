"""Recorded bags, without ROS: reading motion, replaying it, writing loads."""

from slosh_ros.bag.reader import MotionBag
from slosh_ros.bag.replay import Peaks, Recording, replay
from slosh_ros.bag.writer import BagWriter, CsvWriter, writer_for

__all__ = ['BagWriter', 'CsvWriter', 'MotionBag', 'Peaks', 'Recording', 'replay', 'writer_for']
