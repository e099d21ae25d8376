"""One virtual rig for all checks by clients that others wrote."""

import pytest

from .rig import RtdeReader, VirtualRig, taken_ports


@pytest.fixture(scope="session")
def served():
    taken = taken_ports()
    if taken:
        pytest.skip(f"ur_rtde needs the ports {taken} of this machine, and another program has them")
    rig = VirtualRig()
    with RtdeReader("actual_TCP_pose") as reader:
        rig.start_pose = list(reader.newest()[:6])
    yield rig
    rig.end()


@pytest.fixture
def rig(served):
    """Powered, without program, jaws open, whatever the check before did to it."""
    served.make_ready()
    return served
