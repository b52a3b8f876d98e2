"""A job drawn on the emulated brick of a test, with orders at times; a stroke by joint angles."""

import math

from robot.jobs.orders import JobOrders
from robot.jobs.report import JobReport
from robot.jobs.runner import JobRunner
from shared.job import Job, Stroke


class Drawn:
    """A job that was drawn with orders at times; the Rig's world goes on.

    Args:
        rig: Rig, switched on.
        path: of the job.
        orders: (s after the program's start, order).
        status: path of the status file; None: none.
        log, dry: as for JobRunner.

    Attributes:
        begin: when the times of orders count from, s of the world.
    """

    def __init__(
        self, rig, path, orders=(), share=1.0, status=None, repeats=1, log=None, dry=False
    ):
        self.rig, self.said = rig, []
        self.robot = rig.robot(say=lambda line: None)
        self.job = rig.its(Job)(path, rig.arm)
        self.orders = rig.its(JobOrders)(share)
        self.report = rig.its(JobReport)(
            self.job.header, self.job.crc, rig.clock, repeats, self.said.append, status
        )
        self.runner = rig.its(JobRunner)(
            self.robot, rig.clock, self.job, self.orders, self.report, log, dry
        )
        self.begin = rig.world.now()
        for t, order in orders:
            rig.world.at(self.begin + t, lambda order=order: self.orders.handle(order))

    def run(self, *args, **options):
        done = self.runner.run(*args, **options)
        self.robot.park()
        return done


def move(q, end):
    """A Stroke that leads every joint from one pose to another in 2 s, degrees."""
    q, end = ([math.radians(angle) for angle in pose] for pose in (q, end))
    cubics = [[a, 0.0, 3 * (b - a), 2 * (a - b)] for a, b in zip(q, end)]
    return Stroke("", 1.0, 1.0, [([0.0, 2.0], [(0.5, 0.0, cubics, None)], end)])
