"""A job comes over the link part after part, as it was offered or not at all."""

import os
import zlib

import pytest
from offered_jobs import job_file

from laptop.see.serve.job_offer import JobOffer
from robot.jobs.fetching import FETCH_TIMEOUT, RETRY_PERIOD, JobFetching, NotFetched
from shared.job import BadJob
from shared.job_messages import Draw, JobPart, Want, part_of


@pytest.fixture
def offer(tmp_path):
    return JobOffer(job_file(tmp_path))


@pytest.fixture
def target(tmp_path):
    return tmp_path / "brick" / "linked.job"


def fetch(fetching, offer, t=0.0, until=None):
    """Ask and take until it is whole, or so many parts are there."""
    while not fetching.complete and (until is None or fetching.part < until):
        want = fetching.due(t, True)
        assert want == Want(offer.draw.crc, fetching.part)
        fetching.handle(offer.part(want), t)
    return fetching


def test_a_job_comes_as_it_was_offered(offer, target, tmp_path):
    assert offer.draw.parts > 3
    assert offer.draw.name == "a line"
    fetching = fetch(JobFetching(offer.draw, str(target), 0.0), offer)
    assert fetching.due(0.0, True) is None
    assert target.read_bytes() == (tmp_path / "a.job").read_bytes()
    assert os.listdir(str(target.parent)) == ["linked.job"]
    assert offer.asked == offer.draw.parts


def test_what_is_there_already_is_not_fetched_again(offer, target):
    fetch(JobFetching(offer.draw, str(target), 0.0), offer)
    assert JobFetching(offer.draw, str(target), 0.0).complete
    data = bytearray(target.read_bytes())
    data[len(data) // 2] ^= 1
    target.write_bytes(bytes(data))
    again = JobFetching(offer.draw, str(target), 0.0)
    assert not again.complete
    fetch(again, offer)
    assert target.read_bytes() != bytes(data)


def test_a_lost_link_costs_one_part(offer, target):
    fetching = fetch(JobFetching(offer.draw, str(target), 0.0), offer, until=2)
    assert fetching.due(1.0, True).part == 2
    assert fetching.due(1.1, True) is None, "it is on its way"
    assert fetching.due(1.2, False) is None
    assert fetching.due(1.3, True).part == 2, "on a new link it is asked for at once"
    fetch(fetching, offer, 1.4 + RETRY_PERIOD)


def test_a_part_that_does_not_come_is_asked_for_again_and_then_given_up(offer, target):
    fetching = JobFetching(offer.draw, str(target), 0.0)
    assert fetching.due(0.0, True).part == 0
    assert fetching.due(0.9 * RETRY_PERIOD, True) is None
    assert fetching.due(1.1 * RETRY_PERIOD, True).part == 0
    with pytest.raises(
        NotFetched, match="0 of . parts of 'a line' have come, and no more for 21 s"
    ):
        fetching.due(FETCH_TIMEOUT + 1, True)
    fetching.close()
    assert os.listdir(str(target.parent)) == []


def test_what_was_not_asked_for_is_left(offer, target):
    fetching = fetch(JobFetching(offer.draw, str(target), 0.0), offer, until=2)
    fetching.handle(offer.part(Want(offer.draw.crc, 0)), 0.0)
    fetching.handle(offer.part(Want(offer.draw.crc, 3)), 0.0)
    fetching.handle(JobPart(offer.draw.crc ^ 1, 2, "aaaa"), 0.0)
    assert fetching.part == 2
    fetching.close()
    assert offer.part(Want(offer.draw.crc ^ 1, 0)) is None
    assert offer.part(Want(offer.draw.crc, offer.draw.parts)) is None


@pytest.mark.parametrize("wrong", ["garbage", "changed", "larger", "smaller", "bomb"])
def test_what_is_not_as_it_was_offered_is_refused(offer, target, wrong, tmp_path):
    data = (tmp_path / "a.job").read_bytes()
    packed = zlib.compress(data)
    size, crc = len(data), zlib.crc32(data)
    if wrong == "garbage":
        packed = bytes(reversed(packed))
    elif wrong == "changed":
        packed = zlib.compress(data.replace(b"planar", b"plamar"))
    elif wrong == "larger":
        size -= 1
    elif wrong == "smaller":
        size += 1
    else:
        packed = zlib.compress(bytes(100 * 1000 * 1000))
    draw = Draw("it", size, -(-len(packed) // 1425), crc)
    fetching = JobFetching(draw, str(target), 0.0)

    def take_all():
        for k in range(draw.parts):
            fetching.handle(part_of(packed, crc, k), 0.0)

    with pytest.raises(NotFetched, match="'it' did not come as it was offered"):
        take_all()
    fetching.close()
    assert os.listdir(str(target.parent)) == [], "and no earlier job is lost by it"


def test_where_there_is_no_room_it_says_so(offer, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(NotFetched, match="cannot write .*linked.job.part: .*; make room"):
        JobFetching(offer.draw, str(tmp_path / "file" / "linked.job"), 0.0)


def test_only_a_job_is_offered(tmp_path):
    (tmp_path / "no.job").write_text("{}")
    with pytest.raises(BadJob, match="is no job"):
        JobOffer(tmp_path / "no.job")
