"""From modal coefficients and motion to the motion of the liquid and its loads."""

from slosh_ros.modal.carried import CarriedLiquid
from slosh_ros.modal.integrator import ModalIntegrator
from slosh_ros.modal.loads import LoadMatrices, wrench_transform

__all__ = ['CarriedLiquid', 'LoadMatrices', 'ModalIntegrator', 'wrench_transform']
