"""How far a job has come is on file, whole, or it is said that it is not."""

import pytest

from robot.jobs.progress import (
    NoJob,
    SavedProgress,
    find_job,
    forget_progress,
    jobs_folder,
    load_progress,
    progress_file,
    save_progress,
)

CRC = 0xABC
HERE = SavedProgress(7, 2, {"A": 12.5, "B": -3.0}, 0.1)


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))


def test_what_was_saved_is_loaded_until_it_is_forgotten():
    save_progress(CRC, HERE)
    assert load_progress(CRC, 40) == HERE
    with pytest.raises(NoJob, match="leave --resume out"):
        load_progress(CRC + 1, 40)
    forget_progress(CRC)
    forget_progress(CRC)
    with pytest.raises(NoJob):
        load_progress(CRC, 40)


@pytest.mark.parametrize(
    "text",
    ["", "{}", "[]", "\x00", '{"stroke": 1}', '{"stroke": "x", "repeat": 1, "zeros": {}, "pen": 0}',
     '{"stroke": 1, "repeat": 1, "zeros": [], "pen": 0}',
     '{"stroke": 99, "repeat": 1, "zeros": {}, "pen": 0}',
     '{"stroke": 0, "repeat": 1, "zeros": {}, "pen": 0}'],
)  # fmt: skip
def test_a_spoilt_file_is_told_with_what_to_do(text):
    save_progress(CRC, HERE)
    with open(progress_file(CRC), "w") as file:
        file.write(text)
    with pytest.raises(NoJob, match="give --from instead"):
        load_progress(CRC, 40)


def test_a_job_is_found_by_its_name_or_path(tmp_path):
    stored = tmp_path / "jobs" / "rose.job"
    stored.parent.mkdir()
    stored.write_text("x")
    assert str(stored.parent) == jobs_folder()
    for name in ("rose", "rose.job", str(stored)):
        assert find_job(name) == str(stored)
    with pytest.raises(NoJob, match="no job lily"):
        find_job("lily")
