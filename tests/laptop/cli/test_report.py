"""`report`: what it says, its exit status, and the pages that a browser prints of it."""

import re
import stat

import pytest
from click.testing import CliRunner
from lab_runs import a_picture, left
from page_tracker import a_browser
from refusals import in_one_line

from laptop.cli.main import laptop
from laptop.record.report import lab_report, print_pdf
from laptop.record.report.compose import Numbering
from laptop.record.report.report_run import TextTable
from laptop.record.report.run_report import report_of
from laptop.record.run import Ending, table

PAPERS = {"A4": (794, 1123), "letter": (816, 1056)}
"""Width and height, px of CSS."""
MARGIN = 16 / 25.4 * 96
"""Of the page's style, px."""


def run(*args):
    result = CliRunner().invoke(laptop, ["report", *map(str, args)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture
def no_formulas(monkeypatch):
    monkeypatch.setattr("laptop.record.report.method.formula", lambda tex: "")


def test_it_says_where_the_report_is_and_what_was_left_out(tmp_path, no_formulas):
    left(tmp_path / "line")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "run.json").write_text("{")
    result = run(tmp_path, "--title", "Lab 3")
    assert result.exit_code == 0
    assert result.stdout.splitlines() == [
        f"{tmp_path}/lab-report.html: 1 run (1 drawing), 4 tables, 1 figure",
        f"{tmp_path}/lab-report-data: 6 files with the raw data",
    ]
    assert in_one_line(result.stderr, "laptop: left out: bad/run.json: ")
    assert "<h1>Lab 3</h1>" in (tmp_path / "lab-report.html").read_text()
    assert run(tmp_path).exit_code == 1
    assert run(tmp_path, "--replace").exit_code == 0


def test_a_folder_without_runs_is_an_error_and_leaves_nothing(tmp_path):
    result = run(tmp_path)
    assert result.exit_code == 1
    assert result.stderr.count("\n") <= 1
    assert list(tmp_path.iterdir()) == []


def test_decoders_of_pictures_print_nothing_between_its_lines(tmp_path, no_formulas, capfd):
    left(tmp_path / "line")
    (tmp_path / "line" / "picture.png").write_bytes(a_picture()[:-1])
    assert run(tmp_path).exit_code == 0
    assert capfd.readouterr().err == ""
    assert "picture.png is " in (tmp_path / "lab-report.html").read_text()


def test_without_a_browser_no_pdf_is_begun(tmp_path, monkeypatch):
    left(tmp_path / "line")
    monkeypatch.setattr(print_pdf.shutil, "which", lambda name: None)
    monkeypatch.setattr(print_pdf, "BROWSER_PATHS", ())
    result = run(tmp_path, "--to", tmp_path / "x.pdf")
    assert result.exit_code == 1
    assert "Chromium" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["line"]


def test_a_browser_that_prints_nothing_is_told(tmp_path):
    idle = tmp_path / "chromium"
    idle.write_text("#!/bin/sh\nexit 0\n")
    idle.chmod(idle.stat().st_mode | stat.S_IXUSR)
    with pytest.raises(print_pdf.CannotPrint, match="has printed nothing; open the HTML"):
        print_pdf.print_pdf("<p>", tmp_path / "x.pdf", str(idle))
    with pytest.raises(print_pdf.CannotPrint, match="did not start"):
        print_pdf.print_pdf("<p>", tmp_path / "x.pdf", str(tmp_path / "none"))


@pytest.mark.parametrize(
    "printed", ["", "<html>%%EOF", "%PDF-1.4 cut off", "%PDF-1.4 %%EOF" + 2000 * " "]
)
def test_what_a_browser_prints_is_a_whole_pdf(tmp_path, printed):
    odd = tmp_path / "chromium"
    odd.write_text(
        '#!/bin/sh\nfor w in "$@"; do case "$w" in --print-to-pdf=*) out="${w#*=}";; esac; done\n'
        f"printf '%s' '{printed}' > \"$out\"\n"
    )
    odd.chmod(0o755)
    with pytest.raises(print_pdf.CannotPrint) as failed:
        print_pdf.print_pdf("<p>", tmp_path / "x.pdf", str(odd))
    assert str(failed.value) == (
        f"{odd} has printed nothing; open the HTML in a browser and print it from there"
    )
    assert not (tmp_path / "x.pdf").exists()


def test_a_pdf_is_printed_by_the_browser_that_is_there(tmp_path, monkeypatch):
    """A stand-in for the browser wraps the page; the words that it gets are the real one's."""
    fake = tmp_path / "chromium"
    fake.write_text(
        "#!/bin/sh\n"
        'for w in "$@"; do case "$w" in\n'
        '--print-to-pdf=*) out="${w#*=}";; file://*) page="${w#file://}";; esac; done\n'
        '(echo %PDF-1.4; cat "$page"; echo %%EOF) > "$out"\n'
    )
    fake.chmod(0o755)
    monkeypatch.setattr(print_pdf, "BROWSERS", (str(fake),))
    monkeypatch.setattr("laptop.record.report.method.formula", lambda tex: "")
    left(tmp_path / "runs" / "line")
    result = run(tmp_path / "runs", "--to", tmp_path / "x.pdf", "--paper", "letter")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == f"{tmp_path}/x.pdf: the same, printed on letter"
    printed = (tmp_path / "x.pdf").read_text()
    assert "@page { size: letter; }" in printed
    assert "href" not in printed  # in a PDF it would tell a folder of this computer


def wide_table(columns=14):
    """A table with as many columns as a report may have."""
    headings = [f"heading {k} mm" for k in range(columns)]
    return headings, [[f"{k}{k}.125" for k in range(columns)]] * 60


@pytest.mark.long
@pytest.mark.parametrize("paper", PAPERS)
def test_nothing_of_a_report_is_cut_off_in_print(tmp_path, monkeypatch, paper):
    left(tmp_path / "line", what="x" * 300, ending=Ending(0, "y" * 300))
    report = lab_report.lab_report(tmp_path, "Lab", "lab-data")
    table = Numbering().table(TextTable("wide", "Wide", *wide_table()), report.runs)
    report.values["ran_on"] = table
    _check_width(report.html(), paper, rows=60)


@pytest.mark.long
@pytest.mark.parametrize("paper", PAPERS)
def test_nothing_of_a_single_runs_report_is_cut_off_in_print(tmp_path, paper):
    headings, rows = wide_table(12)
    left(tmp_path, tables=[table("wide", "Wide", headings, rows, True)])
    _check_width(report_of(tmp_path).html(), paper, rows=60)


def _check_width(text, paper, rows):
    """Fail unless all of a page is as wide as the paper lets it be, and heads repeat in print."""
    width = PAPERS[paper][0] - 2 * MARGIN
    with a_browser() as browser:
        page = browser.new_page(viewport={"width": round(width), "height": 900})
        page.emulate_media(media="print")
        page.set_content(text)
        boxes = page.evaluate(
            "[...document.querySelectorAll('td, th, img, p, figure, code')]"
            ".map(e => [e.tagName, e.textContent, e.getBoundingClientRect().right])"
        )
        assert sum(tag == "TD" for tag, _, _ in boxes) > rows
        assert [box for box in boxes if box[2] > width + 0.5] == []
        clipped = page.evaluate(
            "[...document.querySelectorAll('body *')].filter("
            "e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX != 'visible')"
            ".length"
        )
        assert clipped == 0
        pdf = page.pdf(format=paper, margin=dict.fromkeys(("left", "right", "top"), "16mm"))
        assert len(re.findall(rb"/Type\s*/Page\b", pdf)) >= 2
