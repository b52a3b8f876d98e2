"""What is told of a job: how long it still takes by the pace so far, and that is on file whole."""

import json

import pytest

from robot.jobs.orders import JobOrders
from robot.jobs.report import JobReport, Place
from shared.job import JobHeader

HEADER = JobHeader("rose", "planar", "planar", (11.3, 9.5), 12.0, 4, 100.0, 10.0, 200.0)


class Clock:
    def __init__(self):
        self.t = 50.0

    def now(self):
        return self.t


@pytest.fixture
def told(tmp_path):
    """A function that tells a place after some seconds; `said`, `status` and `orders` of it."""
    clock, said, orders = Clock(), [], JobOrders()
    report = JobReport(HEADER, 7, clock, 2, said.append, str(tmp_path / "status"))

    def tell(seconds, state, place, **options):
        clock.t += seconds
        report.update(state, place, orders, **options)
        with open(str(tmp_path / "status")) as file:
            tell.status = json.load(file)

    tell.said, tell.orders, tell.report = said, orders, report
    return tell


def test_the_time_left_is_the_plans_until_the_pace_is_known(told):
    told(0, "drawing", Place(1, 1, 0.0, 0.0))
    assert told.status["left_s"] == 400  # twice
    told(5, "drawing", Place(1, 1, 2.0, 4.0))
    assert told.status["left_s"] == 396
    told(50, "drawing", Place(1, 2, 20.0, 44.0))  # 55 s for 44
    assert told.status["left_s"] == round((156 + 200) * 55 / 44)
    told(100, "paused", Place(1, 2, 20.0, 44.0))
    before = told.status["left_s"]
    told(900, "paused", Place(1, 2, 20.0, 44.0))
    assert told.status["left_s"] == before, "a pause says nothing of the pace"


def test_at_half_the_speed_it_takes_twice_as_long(told):
    told(0, "drawing", Place(2, 1, 0.0, 0.0))
    assert told.status["left_s"] == 200
    told.orders.handle("speed 50")
    told(0.1, "drawing", Place(2, 1, 0.0, 0.0))
    assert told.status["left_s"] == 400
    told(80, "drawing", Place(2, 2, 20.0, 40.0))
    assert told.status["left_s"] == pytest.approx(320, abs=2)
    assert told.status["speed"] == 50


def test_people_are_told_now_and_then_and_of_every_change(told):
    told(0, "drawing", Place(1, 1, 0.0, 0.0))
    told(1, "drawing", Place(1, 2, 30.0, 1.0))
    told(9, "drawing", Place(1, 2, 37.0, 10.0))
    told(1, "drawing", Place(1, 3, 50.0, 60.0), tip=(1.0, 2.0), moving=True)
    assert told.status["stroke"] == 3
    assert told.status["tip"] == [1.0, 2.0]
    told(0, "failed", Place(1, 3, 50.0, 60.0), reason="the elbow is blocked")
    assert told.said == [
        "0 %, stroke 1 of 4, time 1 of 2, 6:40 left",
        "37 %, stroke 2 of 4, time 1 of 2, 6:30 left",
        "failed at 50 %, stroke 3 of 4, time 1 of 2: the elbow is blocked",
    ]
    assert told.status["reason"] == "the elbow is blocked"


def test_where_the_status_cannot_be_written_the_drawing_goes_on(tmp_path):
    clock, said, orders = Clock(), [], JobOrders()
    report = JobReport(HEADER, 7, clock, 1, said.append, str(tmp_path / "none" / "status"))
    report.update("drawing", Place(1, 1, 0.0, 0.0), orders, moving=True)
    report.update("drawing", Place(1, 1, 0.0, 0.0), orders)
    report.update("paused", Place(1, 1, 0.0, 0.0), orders)
    assert [line for line in said if "cannot be written" in line] == [said[0]]
