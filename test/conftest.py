"""What all tests share: DDS on loopback only, in a domain of their own; a cache of their own."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import slosh_ros  # noqa: F401 - before NumPy, so that its BLAS keeps to one thread

REPOSITORY = Path(__file__).resolve().parents[1]

# Discovery on loopback may miss the first announcement and then wait for seconds (no multicast):
# announce often at the start.
_FAST_DISCOVERY = """<dds xmlns="http://www.eprosima.com"><profiles>
<participant profile_name="fast" is_default_profile="true"><rtps><builtin><discovery_config>
<initialAnnouncements><count>40</count><period><nanosec>100000000</nanosec></period>
</initialAnnouncements></discovery_config></builtin></rtps></participant></profiles></dds>
"""


@pytest.fixture(scope='session', autouse=True)
def _loopback_only(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp('ros')
    profile = folder / 'fastdds.xml'
    profile.write_text(_FAST_DISCOVERY)
    domain = int(os.environ.get('ROS_DOMAIN_ID', os.getpid()))
    # pytest-xdist: nodes of one worker (gw0, gw1 ...) must not hear those of another
    worker = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0')[2:])
    os.environ['ROS_DOMAIN_ID'] = str((domain - 1 + 37 * worker) % 101 + 1)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(profile)
    os.environ['ROS_LOG_DIR'] = str(folder / 'log')


@pytest.fixture(scope='session', autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Neither read nor write tables of the user; Matplotlib's list of fonts may stay."""
    given = Path(os.environ.get('XDG_CACHE_HOME', '') or Path.home() / '.cache')
    os.environ.setdefault('MPLCONFIGDIR', str(given / 'matplotlib'))
    os.environ['XDG_CACHE_HOME'] = str(tmp_path_factory.mktemp('cache'))
