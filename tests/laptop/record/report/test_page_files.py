"""What is saved from the page and written by `track`."""

import base64

import pytest
from lab_runs import a_picture
from page_scene import PageScene

from laptop.page import report, report_figures
from laptop.record.figures.document import photograph
from laptop.record.report.findings import TRACKING, DamagedRun
from laptop.record.report.page_files import (
    HISTORY,
    REPORT,
    PageReport,
    is_track,
    read_history,
    read_page_report,
    read_track,
)
from laptop.record.report.servo_runs import GOALS
from shared.messages import Start


@pytest.fixture
def saved(tmp_path, monkeypatch):
    """The page's report of a run that was refused."""
    monkeypatch.setattr(report_figures, "png_of", lambda figure: a_picture())
    scene = PageScene(tmp_path)
    scene.show()
    scene.server.tell("refused", 1, reason="no zero")
    scene.show()
    record = scene.controller.record()
    record.runs[0].orders = Start(method="kalman")
    file = tmp_path / report.file_name(record)
    file.write_text(report.render(record), encoding="utf-8")
    return file


def test_a_report_of_the_page_is_read_as_it_was_written(saved):
    assert REPORT.fullmatch(saved.name)
    run = read_page_report("r", saved)
    ((table, row),) = run.results
    assert (table, row[2:4]) == (GOALS, ("kalman", "refused"))
    assert run.methods == ["kalman"]
    assert run.outcome == "The brick refused these orders."
    assert [figure.picture for figure in run.figures] == [a_picture()] * 2
    assert run.figures[0].caption.startswith("Lines are what the tracker saw")


def test_pictures_of_a_report_that_are_none_are_left_out(saved):
    held = base64.b64encode(a_picture()).decode()
    text = saved.read_text()
    assert held in text
    for other in (held[:-40], "!"):
        saved.write_text(text.replace(f"base64,{held}", f"base64,{other}"))
        run = read_page_report("r", saved)
        assert run.figures == []
        assert len(run.gaps) == 1 + 2
    saved.write_text(text.replace("data:image/png;base64,", "https://example.org/"))
    assert read_page_report("r", saved).figures == []


def test_photographs_of_a_report_are_jpegs(saved):
    photo = photograph(a_picture(), 90)
    held = f"image/png;base64,{base64.b64encode(a_picture()).decode()}"
    told = f"image/jpeg;base64,{base64.b64encode(photo).decode()}"
    saved.write_text(saved.read_text().replace(held, told))
    assert [figure.picture for figure in read_page_report("r", saved).figures] == [photo] * 2


def test_another_page_is_no_report(saved):
    for text in ("", "<h1>Hello</h1>", saved.read_text()[:-9]):
        saved.write_text(text)
        with pytest.raises(DamagedRun, match="is no whole report of the page"):
            read_page_report("r", saved)


@pytest.mark.parametrize(
    ("part", "many", "why"),
    [
        ("</table>", "<tr><td>1" * 1001, "has more than 1000 goals"),
        ("</table>", "<td>1" * 20_001, "has more than 20000 values"),
        ("</html>", "<p>1" * 5001, "has more than 5000 texts"),
        (
            "</html>",
            "<img src='a'><figcaption>1</figcaption>" * 51,
            "has more than 50 pictures",
        ),
        ("</html>", "<" * 400_001, "has more than 400000 tags"),
    ],
)
def test_a_page_with_more_of_something_than_any_report_has_is_not_read_on(saved, part, many, why):
    saved.write_text(saved.read_text().replace(part, many + part, 1))
    with pytest.raises(DamagedRun) as failed:
        read_page_report("r", saved)
    assert str(failed.value) == f"{saved.name} {why}"


def test_a_page_that_is_cut_off_is_not_parsed(saved, monkeypatch):
    saved.write_text(saved.read_text()[:-9])
    monkeypatch.setattr(PageReport, "feed", lambda *words: pytest.fail("it is parsed"))
    with pytest.raises(DamagedRun, match="is no whole report of the page"):
        read_page_report("r", saved)


def test_the_plots_of_the_page_are_drawn(tmp_path):
    file = tmp_path / "history (1).csv"
    assert HISTORY.fullmatch(file.name)
    file.write_text("t,error_px,q1_deg,condition,moves\n10,20,5,,0\n11,,6,2,1\n14,2,7,3,2\n")
    run = read_history("history", file)
    assert (run.seconds, len(run.figures), run.results) == (4.0, 1, [])
    file.write_text("t,error_px\n1,\n2,\n")
    run = read_history("history", file)
    assert run.figures == []
    assert run.gaps[0] == "history (1).csv holds neither an error nor joint angles"
    file.write_text("t,other\n1,2\n")
    with pytest.raises(DamagedRun, match="has no columns t and error_px"):
        read_history("history", file)
    file.write_text("t,error_px\n,1\n,2\n")
    with pytest.raises(DamagedRun, match="holds no time in its column t"):
        read_history("history", file)


def test_a_csv_of_markers_tells_how_often_each_was_seen(tmp_path):
    file = tmp_path / "mine.csv"
    file.write_text(
        "frame,t,camera,marker,u,v,confidence\n"
        "1,5.0,A,goal,10,20,1\n1,5.0,B,goal,,,\n2,5.5,A,goal,,,\n2,5.5,B,goal,,,\n"
    )
    assert is_track(file)
    run = read_track("mine.csv", file)
    assert run.kind == TRACKING
    assert run.tables[0].rows == [
        ("A", "goal", "2", "50 %", "0.5"),
        ("B", "goal", "2", "0 %", "0.5"),
    ]
    assert len(run.figures) == 1
    file.write_text("frame,t,marker,u,v,confidence\n1,5.0,goal,,,\n")
    assert read_track("mine.csv", file).gaps == ["mine.csv: no marker was seen"]
    file.write_text("frame,t,marker,u,v,confidence\n1,5.0,goal,x,,\n")
    with pytest.raises(DamagedRun, match="a row of goal holds no numbers"):
        read_track("mine.csv", file)
    file.write_text("a,b\n")
    assert not is_track(file)
