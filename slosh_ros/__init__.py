"""Sloshing loads of partly filled tanks, in real time: live on ROS 2 or offline from a bag."""

__version__ = '0.1.0'
