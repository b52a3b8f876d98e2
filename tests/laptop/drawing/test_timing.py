"""The estimate, against runs on the emulated brick, which computes as slowly as a real one."""

import numpy as np
import pytest
from click.testing import CliRunner
from places import ROOT
from run_json import run_in

from laptop.cli.main import laptop
from laptop.drawing import preparing, sources
from laptop.drawing.artwork import Artwork
from laptop.drawing.gallery_files import gallery
from laptop.drawing.options import DrawingOptions
from shared.arm_description import find_arm, read_arm


def house():
    """Walls and a round window: corners, a curve, a lift."""
    t = np.linspace(0, 2 * np.pi, 60)
    window = np.column_stack([2 + 0.6 * np.cos(t), 2 + 0.6 * np.sin(t)])
    walls = np.array([(0, 0), (4, 0), (4, 3), (0, 3), (0, 0), (4, 3)], float)
    return Artwork("house", (walls, window), ("",) * 2)


def run(artwork, arm, folder, **options):
    """(s estimated, s taken on the emulated brick)."""
    plan = preparing.prepare(artwork, read_arm(find_arm(arm)), DrawingOptions(**options))
    plan.write_job(folder / "x.job")
    done = CliRunner().invoke(
        laptop,
        ["simulate", "--no-picture", "--timeout", "3000", "--arm", arm, "--out", str(folder),
         str(ROOT / "robot" / "driver.py"), "job", str(folder / "x.job"), "--arm", arm],
        catch_exceptions=False,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    seconds = run_in(folder)["seconds"]
    return plan.estimate.seconds, seconds


def test_the_estimate_is_within_5_percent_of_a_run(tmp_path):
    estimated, taken = run(house(), "planar", tmp_path, size=(4, None))
    assert estimated == pytest.approx(taken, rel=0.05)


@pytest.mark.claims
@pytest.mark.parametrize("arm", ["planar", "geared", "spatial"])
@pytest.mark.parametrize("name", gallery())
def test_the_estimate_is_within_5_percent_for_the_gallery(name, arm, tmp_path):
    estimated, taken = run(sources.read_source(name), arm, tmp_path)
    assert estimated == pytest.approx(taken, rel=0.05)
