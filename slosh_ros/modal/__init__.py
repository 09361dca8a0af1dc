"""From modal coefficients and motion to the motion of the liquid and its loads."""

from slosh_ros.modal.integrator import ModalIntegrator
from slosh_ros.modal.loads import LoadMatrices, wrench_transform

__all__ = ['LoadMatrices', 'ModalIntegrator', 'wrench_transform']
