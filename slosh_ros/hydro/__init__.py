"""
From tank and fill to modal coefficients.

Every route ends in :class:`~slosh_ros.hydro.coefficients.ModalCoefficients`; nothing above this
floor knows which route was taken. A new route is one module here and one line in
:func:`~slosh_ros.hydro.routes.coefficients_of`.
"""

from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.routes import coefficients_of

__all__ = ['ModalCoefficients', 'coefficients_of']
