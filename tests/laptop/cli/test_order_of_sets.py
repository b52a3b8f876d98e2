"""In which order commands walk sets: in the same one each time, but for who serves others."""

import os
import subprocess
import sys

import pytest
from places import ROOT

BEGINS = """
import os, sys
sys.argv = ["laptop", *sys.argv[1:]]
from laptop.cli.start import order_sets
order_sets()
print(os.getpid(), sys.flags.hash_randomization, hash("brick"), sys.argv[1:], sys.flags.isolated)
sys.exit(7)
"""


def begun(seed, *args, options=()):
    """What a process that began with these words told, number, randomness, hash, words; and it."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONHASHSEED"}
    if seed is not None:
        environment["PYTHONHASHSEED"] = seed
    done = subprocess.Popen(
        [sys.executable, *options, "-c", BEGINS, *args],
        cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    reported = done.communicate()[0].split(maxsplit=3)
    assert done.returncode == 7
    return (*map(int, reported[:3]), reported[3].rstrip()), done


@pytest.mark.parametrize("word", ["simulate", "bench"])
def test_a_command_walks_sets_in_the_order_of_all_others(word):
    reported = [begun(seed, word, "a b", "")[0] for seed in (None, "0", "17")]
    assert {one[1:] for one in reported} == {(0, reported[0][2], repr([word, "a b", ""]) + " 0")}


@pytest.mark.parametrize("word", ["track", "page"])
@pytest.mark.parametrize("seed", [None, "0"])
def test_who_serves_others_walks_them_in_an_order_that_nobody_knows(seed, word):
    reported = [begun(seed, word)[0] for _ in range(2)]
    assert [one[1] for one in reported] == [1, 1]
    assert reported[0][2] != reported[1][2]


@pytest.mark.skipif(os.name == "nt", reason="there it is another process")
def test_it_is_the_process_that_was_started_whom_signals_reach():
    reported, process = begun("17", "simulate")
    assert reported[0] == process.pid


def test_where_python_heeds_no_variables_it_begins_but_once():
    assert begun("17", "simulate", options=["-E"])[0][1] == 1
