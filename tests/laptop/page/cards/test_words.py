"""What people read of how a run and a drawing go: each end in words of its own."""

from types import SimpleNamespace

import pytest

from laptop.page.cards import draw_progress, drive
from laptop.page.job_states import reported_state
from laptop.page.report import verdict_text
from shared.job_messages import ENDS, JobStatus
from shared.verdicts import VERDICT_TEXTS


def test_every_end_of_a_drawing_is_told_in_its_words():
    reported = [JobStatus(9.0, 7, "rose", end, 2, 5, 4.0, 10.0, None, False, "") for end in ENDS]
    assert [
        draw_progress.job_text(reported_state(status, is_lost=False, alone=False))
        for status in reported
    ] == ["rose: done", "rose: aborted at 40 %", "rose: ended at 40 %"]


@pytest.mark.parametrize("word", ["converged", "stopped", "ink dry"])
def test_a_verdict_of_the_table_is_told_on_the_page_and_in_its_report(word, monkeypatch):
    monkeypatch.setitem(VERDICT_TEXTS, "ink dry", "The pen is dry. Put in another.")
    state = SimpleNamespace(
        brick="127.0.0.1", following=False, running=False, status=SimpleNamespace(verdict=word)
    )
    assert drive.verdict_text(state)[0] == VERDICT_TEXTS[word]
    assert verdict_text(SimpleNamespace(ended=9.0, verdict=word)) == VERDICT_TEXTS[word]
