"""Jobs that aim at what an arm may not do: what is refused, and what the true joints did."""

import json
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from tests.claims import aimed_jobs
from tests.claims.__main__ import claims


def drawn_jobs(count):
    """What came of the jobs of the first seeds, for each arm."""
    it = SimpleNamespace(seeds=range(40000, 40000 + count), arms=("planar", "spatial"))
    return list(map(aimed_jobs.draw_it, aimed_jobs.BENCH.cases(it)))


@pytest.mark.long
def test_of_jobs_that_aim_at_the_bounds_none_leads_beyond_them():
    results = drawn_jobs(36)
    refused = [one for one in results if one.refused]
    drawn = [one for one in results if not one.refused]
    assert len(refused) > len(drawn) > 3
    assert all("; " in one.refused for one in refused), "each with the next step"
    assert [one.ended for one in drawn] == [""] * len(drawn)
    assert -30 < max(one.beyond_deg for one in drawn) < 3
    assert 0.1 < max(one.speed for one in drawn) < 1.1


def test_the_table_has_a_row_for_what_was_aimed_at():
    results = drawn_jobs(6)
    assert 0 < sum(bool(one.refused) for one in results) < len(results)
    rows = aimed_jobs.table(results)
    assert sum(int(row[2]) for row in rows) == len(results)
    assert sum(int(row[3]) for row in rows) == sum(bool(one.refused) for one in results)
    assert all(len(row) == len(aimed_jobs.HEADINGS) for row in rows)


def test_the_command_tells_all_figures():
    shown = CliRunner().invoke(claims, ["jobs", "--seeds", "40000:40002", "--json"])
    assert [one["seed"] for one in json.loads(shown.stdout)] == [40000, 40001]
