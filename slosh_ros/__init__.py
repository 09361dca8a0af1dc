"""Sloshing loads of partly filled tanks, in real time: live on ROS 2 or offline from a bag."""

import os

# The matrices here have some hundred rows. More BLAS threads gain nothing on them, and on a busy
# machine they wait for one another for seconds. Takes effect if NumPy is not yet imported.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

__version__ = '0.1.0'
