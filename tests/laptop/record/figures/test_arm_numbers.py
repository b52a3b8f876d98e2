"""An arm's numbers as a run keeps them."""

import json

from laptop.record.figures.arm_numbers import numbers_of
from shared.arm_description import find_arm, read_arm


def test_they_are_those_of_the_file_in_its_units_and_without_its_place():
    numbers = numbers_of(read_arm(find_arm("spatial")))
    assert (numbers["name"], numbers["chain"], numbers["speed_cm_s"]) == ("spatial", "spatial", 4)
    assert numbers["joints"][1] == {
        "name": "shoulder",
        "link_cm": 11.3,
        "motor": "large",
        "port": "B",
        "gear": 5.0,
        "lower_deg": -20.0,
        "upper_deg": 130.0,
        "backlash_deg": 2.0,
        "max_speed_deg_s": 60.0,
        "mass_g": 106.0,
    }
    assert "/" not in json.dumps(numbers)
