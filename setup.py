"""Installation of slosh_ros by colcon (for `ros2 run`) and by pip (into a virtual environment)."""

import os
from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'slosh_ros'
# resolve(): `colcon build --symlink-install` runs a link to this file from its build folder
MANIFEST = ElementTree.parse(Path(__file__).resolve().parent / 'package.xml')


def shared(top):
    """List a folder with all below it for installation under share/slosh_ros."""
    return [
        (os.path.join('share', NAME, folder), [os.path.join(folder, name) for name in names])
        for folder, _, names in os.walk(top)
        if names
    ]


setup(
    name=NAME,
    version=MANIFEST.findtext('version'),
    description='Sloshing loads of partly filled tanks in real time, on ROS 2 and offline',
    license='Apache-2.0',
    maintainer=MANIFEST.findtext('maintainer'),
    maintainer_email=MANIFEST.find('maintainer').get('email'),
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed', 'study/data/*/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/launch', sorted(glob('launch/*.launch.py'))),
        *shared('config'),
    ],
    python_requires='>=3.10',
    # The lower bounds are what Ubuntu 24.04 ships, or the oldest that works beside it; CI tests
    # them (requirements/oldest.txt).
    install_requires=[
        'matplotlib>=3.6.3',
        'numpy>=1.26',
        'rich>=13.7',
        'rosbags>=0.11',
        'ruamel.yaml>=0.17.21',
        'scipy>=1.11',
        'typer>=0.9',
    ],
    # colcon runs pytest only if it finds it here: setuptools has dropped `tests_require`.
    extras_require={
        'bem': ['capytaine>=2.2'],
        'files': ['h5py>=3.10', 'netCDF4>=1.6.5', 'xarray>=2023.1'],
        'mesh': ['rtree>=1.0', 'trimesh>=4.0'],
        'test': [
            'hypothesis>=6.98',
            'imageio-ffmpeg>=0.5',
            'manifold3d>=2.3',
            'psutil>=5.9.8',
            'pytest>=7.4',
            'pytest-timeout>=2.2',
            'pytest-xdist>=3.4',
            'scikit-fem>=9.0',
            'sympy>=1.12',
        ],
    },
    entry_points={
        'console_scripts': [
            f'slosh = {NAME}.cli:main',
            f'slosh_node = {NAME}.ros.start:slosh_node',
            f'vehicle_node = {NAME}.ros.start:vehicle_node',
            f'rollover_node = {NAME}.ros.start:rollover_node',
        ]
    },
    zip_safe=False,
)
