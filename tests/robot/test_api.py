"""What people import: it is all there, and loaded when used."""

import subprocess
import sys

import pytest
from places import ROOT

from robot import api


@pytest.mark.parametrize("name", api.__all__)
def test_every_name_is_there(name):
    value = getattr(api, name)
    assert getattr(value, "__name__", name) == name


def test_nothing_is_loaded_before_it_is_used():
    code = (
        "import sys; from robot import api; before = set(sys.modules); api.Clock;"
        "print(sorted(m for m in before if m.startswith(('robot.', 'shared'))));"
        "print(sorted(m for m in set(sys.modules) - before if m.startswith(('robot.', 'shared'))))"
    )
    out = subprocess.check_output([sys.executable, "-c", code], cwd=str(ROOT))
    assert out.decode().splitlines() == ["['robot.api']", "['robot.clock']"]


def test_a_wrong_name_is_answered_with_the_right_ones():
    with pytest.raises(AttributeError, match="has no Drover; it has .*Driver"):
        api.Drover  # noqa: B018
    assert dir(api) == api.__all__
