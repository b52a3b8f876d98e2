"""Cameras and a tracker before an emulated arm, as one text describes them."""

import textwrap

import pytest
from places import ROOT
from refusals import refused

from laptop.emulator import rig as rig_module
from laptop.emulator.faults import InvalidSimulationOption
from laptop.emulator.rig import Rig
from laptop.emulator.watching import watching


def test_cameras_see_where_the_arm_truly_is(capsys):
    with Rig("planar", plant="cpu=0", cameras="tilt=20,noise=0") as rig:
        before = rig.see()
        rig.run("driver.py", "move", "12,6")
        after = rig.see()
    assert "tip at" in capsys.readouterr().out
    assert list(before) == list(after) == ["A"]
    assert before["A"].image.shape == (480, 640, 3)
    assert (before["A"].image != after["A"].image).any()
    assert after["A"].t > before["A"].t


@pytest.mark.long
def test_what_its_docstring_and_its_page_show_works(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "laptop" / "docs" / "how-to" / "use-the-emulator.md").read_text("utf-8")
    shown = textwrap.dedent(rig_module.__doc__.split("\n\n")[1])
    on_the_page = page.partition("```py\n")[2].partition("```")[0]
    on_the_page = on_the_page.replace("from brickservo import", "from laptop.emulator.rig import")
    for source in ("from laptop.emulator.rig import Rig\n" + shown, on_the_page):
        exec(compile(source, "shown", "exec"), {})
    output = capsys.readouterr()
    assert "converged" in output.out + output.err or "stalled" in output.out + output.err


def test_cameras_in_virtual_time_share_their_pace():
    arm = Rig("spatial").arm
    with pytest.raises(InvalidSimulationOption) as error:
        watching("B.fps=10", arm)
    assert refused(error, "B.fps", "share")


@pytest.mark.parametrize(
    "ask", [lambda rig: rig.tip, lambda rig: rig.see(), lambda rig: rig.run("driver.py")]
)
def test_a_brick_without_an_arm_has_no_tip_and_nothing_to_watch(ask):
    with Rig(None, cameras="") as rig, pytest.raises(InvalidSimulationOption) as error:
        ask(rig)
    assert refused(error, "no arm")
