"""All claims alike: each is listed with one line, has cases, and a wrong name is told in one."""

import re
import subprocess
import sys
from importlib import import_module
from types import SimpleNamespace

import pytest
from click import Context
from click.testing import CliRunner
from places import ROOT

from tests.claims.__main__ import CLAIMS, claims


def test_without_a_name_all_are_listed_with_a_line_each():
    shown = CliRunner().invoke(claims, [])
    assert shown.exit_code == 0
    for record in CLAIMS:
        assert re.search(rf"^  {record.name} +{re.escape(record.help)}$", shown.stdout, re.M)


@pytest.mark.long
def test_a_wrong_name_is_told_in_one_line():
    done = subprocess.run(
        [sys.executable, "-m", "tests.claims", "nothing"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "No such command 'nothing'. See python -m tests.claims --help" in line


@pytest.mark.parametrize("record", CLAIMS, ids=lambda record: record.name)
def test_each_has_cases_where_nothing_more_is_typed(record):
    typed = claims.commands[record.name].make_context(record.name, [], Context(claims)).params
    bench = import_module(record.module).BENCH
    assert len(bench.cases(SimpleNamespace(**typed))) > 0
    assert bool(bench.work) != bool(bench.in_turn)
