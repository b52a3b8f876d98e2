"""For how long what was seen counts as seen."""

import pytest
from rig import described

from robot.servoing.repeated_pictures import RepeatedPictures
from robot.servoing.sightings import Sightings
from shared.messages import Observation

TIP = {"effector": (100.0, 100.0, 1.0)}


@pytest.mark.parametrize("moving", [True, False])
def test_a_camera_sees_for_three_tenths_of_a_second_after_its_last_sighting(moving):
    pictures = RepeatedPictures(described("planar").joints)
    sightings = Sightings({"A": (400.0, 200.0)}, False, pictures)
    sightings.history.add(0.0, (0.0, 0.0))
    assert sightings.frame(Observation(1, "A", 0.95, TIP), 1.0, moving)
    assert sightings.frame(Observation(2, "A", 1.05, {}), 1.1, moving) is None
    assert sightings.seeing(1.299) == ["A"]
    assert sightings.seeing(1.301) == []
