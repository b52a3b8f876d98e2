"""Rigs of cameras and a brick for commands that measure by both."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.track import open_synthetic, run_on_brick, start_brick
from shared import pairing
from shared.arm_description import find_arm, read_arm

if TYPE_CHECKING:
    from laptop.measure.live_rig import LiveRig
    from laptop.see.serve.server import TrackingServer
    from shared.job_messages import JobStatus


@dataclass(frozen=True)
class RigOptions:
    """Options of a rig of cameras and a brick.

    sources   of the cameras, as for `track`
    arm       its name or file
    scene     of synthetic cameras
    effector  the marker's SPEC, as for `track`
    markers   the markers file, as for `track`
    size      asked of webcams, as for `track`
    host      to listen at, as for `track`
    port      to listen at, as for `track`
    call      the real brick of that name, "" for the last one, is started over ssh; None: it is
              told what to type
    """

    sources: Sequence[str]
    arm: str
    scene: str = ""
    effector: str | None = None
    markers: Path | None = None
    size: str | None = None
    host: str = ""
    port: int | None = None
    call: str | None = None


@contextmanager
def live_rig(
    asked: RigOptions, report: Callable[[JobStatus], None] = lambda status: None
) -> Iterator[LiveRig]:
    """Open cameras, accept a brick, and track; all ends with the block.

    Before a synthetic camera an emulated brick comes by itself.

    Args:
        asked: what it is opened with.
        report: as for LiveRig.

    Raises:
        ArmError: a camera, marker or port cannot be had.
    """
    from laptop.measure.live_rig import LiveRig, SightCollector
    from laptop.see.markers.tracker import Tracker
    from laptop.see.serve.options import CAMERA_NAMES, TrackOptions
    from laptop.see.serve.pipeline import CameraPipeline, PipelineOutputs
    from laptop.see.serve.setup import prepare
    from laptop.see.serve.track import clock_of, serve
    from laptop.system.decoders import quiet_decoders
    from shared.messages import EFFECTOR

    options = TrackOptions(
        camera=tuple(asked.sources),
        effector=asked.effector,
        goal=(),
        pick=(),
        markers=asked.markers,
        scene=asked.scene,
        csv=None,
        serve=True,
        host=asked.host,
        port=asked.port,
        fps=None,
        size=asked.size,
        picture=None,
    )
    with ExitStack() as stack:
        stack.enter_context(quiet_decoders())
        setup = prepare(options, partial(open_synthetic, asked.arm), stack)
        now = clock_of(setup.cameras)
        server = serve(options, stack, now, click.echo)
        collector = SightCollector(server)
        outputs = PipelineOutputs(collector)
        marks = [marker for marker in setup.markers if marker.name == EFFECTOR]
        pipelines = [
            CameraPipeline(name, camera, Tracker(marks), None, outputs, setup.live, now)
            for name, camera in zip(CAMERA_NAMES, setup.cameras, strict=False)
        ]
        called = _brick_of(asked, server)
        brick = stack.enter_context(called) if called else None
        rig = LiveRig(read_arm(find_arm(asked.arm)), pipelines, server, collector, report, brick)
        stack.enter_context(rig.watching())
        yield rig


def _brick_of(
    asked: RigOptions, server: TrackingServer
) -> AbstractContextManager[Callable[[], str]] | None:
    """Return the function that starts a brick, see `start_brick`; None: users start it."""
    from laptop.see.serve.setup import SYNTHETIC

    if SYNTHETIC in asked.sources:
        return start_brick(asked.arm, server.place)
    if asked.call is not None:
        return run_on_brick(server.port, asked.call)
    first, *others = (f"{command} --wait --arm {asked.arm}" for command in server.commands())
    click.echo(f"let the brick wait for it; type here: {first}")
    for other in others:
        click.echo(f"               or on the brick itself: {other}")
    code = pairing.show_code(server.code)
    click.echo(f"  which asks for the pairing code, once: {code}")
    return None
