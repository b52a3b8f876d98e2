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
def reporter(tmp_path):
    """A function that tells a place after some seconds; `said`, `status` and `orders` of it."""
    clock, output, orders = Clock(), [], JobOrders()
    report = JobReport(HEADER, 7, clock, 2, output.append, str(tmp_path / "status"))

    def report_state(seconds, state, place, **options):
        clock.t += seconds
        report.update(state, place, orders, **options)
        with open(str(tmp_path / "status")) as file:
            report_state.status = json.load(file)

    report_state.lines, report_state.orders, report_state.report = output, orders, report
    return report_state


def test_the_time_left_is_the_plans_until_the_pace_is_known(reporter):
    reporter(0, "drawing", Place(1, 1, 0.0, 0.0))
    assert reporter.status["left_s"] == 400  # twice
    reporter(5, "drawing", Place(1, 1, 2.0, 4.0))
    assert reporter.status["left_s"] == 396
    reporter(50, "drawing", Place(1, 2, 20.0, 44.0))  # 55 s for 44
    assert reporter.status["left_s"] == round((156 + 200) * 55 / 44)
    reporter(100, "paused", Place(1, 2, 20.0, 44.0))
    before = reporter.status["left_s"]
    reporter(900, "paused", Place(1, 2, 20.0, 44.0))
    assert reporter.status["left_s"] == before, "a pause says nothing of the pace"


def test_at_half_the_speed_it_takes_twice_as_long(reporter):
    reporter(0, "drawing", Place(2, 1, 0.0, 0.0))
    assert reporter.status["left_s"] == 200
    reporter.orders.handle("speed 50")
    reporter(0.1, "drawing", Place(2, 1, 0.0, 0.0))
    assert reporter.status["left_s"] == 400
    reporter(80, "drawing", Place(2, 2, 20.0, 40.0))
    assert reporter.status["left_s"] == pytest.approx(320, abs=2)
    assert reporter.status["speed"] == 50


def test_people_are_told_now_and_then_and_of_every_change(reporter):
    reporter(0, "drawing", Place(1, 1, 0.0, 0.0))
    reporter(1, "drawing", Place(1, 2, 30.0, 1.0))
    reporter(9, "drawing", Place(1, 2, 37.0, 10.0))
    reporter(1, "drawing", Place(1, 3, 50.0, 60.0), tip=(1.0, 2.0), moving=True)
    assert reporter.status["stroke"] == 3
    assert reporter.status["tip"] == [1.0, 2.0]
    reporter(0, "failed", Place(1, 3, 50.0, 60.0), reason="the elbow is blocked")
    assert reporter.lines == [
        "0 %, stroke 1 of 4, time 1 of 2, 6:40 left",
        "37 %, stroke 2 of 4, time 1 of 2, 6:30 left",
        "failed at 50 %, stroke 3 of 4, time 1 of 2: the elbow is blocked",
    ]
    assert reporter.status["reason"] == "the elbow is blocked"


def test_where_the_status_cannot_be_written_the_drawing_goes_on(tmp_path):
    clock, output, orders = Clock(), [], JobOrders()
    (tmp_path / "file").write_text("")
    report = JobReport(HEADER, 7, clock, 1, output.append, str(tmp_path / "file" / "status"))
    report.update("drawing", Place(1, 1, 0.0, 0.0), orders, moving=True)
    report.update("drawing", Place(1, 1, 0.0, 0.0), orders)
    report.update("paused", Place(1, 1, 0.0, 0.0), orders)
    assert [line for line in output if "cannot be written" in line] == [output[0]]
