"""What all tests share: DDS on loopback only, in a domain of their own."""

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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let tests with real nodes run one after the other: they have deadlines."""
    for item in items:
        if any(item.iter_markers('ros')) or any(item.iter_markers('colcon')):
            item.add_marker(pytest.mark.xdist_group('nodes'))


@pytest.fixture(scope='session', autouse=True)
def _loopback_only(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp('ros')
    profile = folder / 'fastdds.xml'
    profile.write_text(_FAST_DISCOVERY)
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(profile)
    os.environ['ROS_LOG_DIR'] = str(folder / 'log')
