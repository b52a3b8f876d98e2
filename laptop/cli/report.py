"""`report`: a lab report of the runs in a folder."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import click

from laptop.cli.command import OwnCommand
from laptop.cli.options import examples, importing, in_one_line
from laptop.system.files import check_new, written
from shared.message_fields import printable

if TYPE_CHECKING:
    from laptop.record.report.compose import Report


@click.command(
    cls=OwnCommand,
    short_help="Make a lab report of the runs in a folder.",
    epilog=examples(
        "report runs",
        'report runs --title "Lab 3: straight lines" --to lab3.pdf --paper letter',
    ),
)
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--to",
    "files",
    multiple=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The .html report, its raw data in a folder beside it; a .pdf is printed, too, by a "
    "Chromium, Chrome or Edge that is installed.  [default: lab-report.html in FOLDER]",
)
@click.option("--title", default="", metavar="TEXT", help="Over the report.")
@click.option(
    "--replace",
    is_flag=True,
    help="A report that is there, with what was typed in it, and its raw data.",
)
@click.option(
    "--paper",
    type=click.Choice(["a4", "letter"]),
    default="a4",
    show_default=True,
    help="Of the PDF; the HTML prints on both.",
)
def report(folder: Path, files: tuple[Path, ...], title: str, replace: bool, paper: str) -> None:
    """Make a lab report of the runs in FOLDER and below it: one HTML file, raw data beside it.

    It takes what every command leaves in its folder, logs of visual_servoing.py and CSVs of track.
    Fields for names and discussion are left blank.  What is not in the files is not in the report.
    """
    with importing():  # matplotlib
        from laptop.record.report import lab_report, print_pdf
        from laptop.system.decoders import quiet_decoders

    with in_one_line():
        out, pdf = _outputs(files)
        file = out or folder / lab_report.OUT
        check_new(file, (".html", ".htm"), replace=True)  # what of it, the next line says
        lab_report.check_out(file, replace)
        if pdf:
            check_new(pdf, (".pdf",), replace)
        browser = print_pdf.find_browser() if pdf else ""
        data = lab_report.data_folder_of(file)
        with quiet_decoders():
            made = lab_report.lab_report(folder, title or lab_report.TITLE, data.name)
        lab_report.write(made, file)
        click.echo(_summary(file, made))
        click.echo(f"{data}: {len(made.data)} files with the raw data")
        if pdf:
            html = made.html(lab_report.PAPERS[paper], linked=False)
            with written(pdf) as draft:
                print_pdf.print_pdf(html, draft, browser)
            click.echo(f"{pdf}: the same, printed on {paper}")
    for left in made.left_out:
        click.echo(f"laptop: left out: {printable(f'{left.name}: {left.why}')}", err=True)


def _outputs(files: tuple[Path, ...]) -> tuple[Path | None, Path | None]:
    """Return the HTML file and the PDF that are to be written."""
    for file in files:
        check_new(file, (".html", ".htm", ".pdf"), replace=True)
    pdfs = [file for file in files if file.suffix.lower() == ".pdf"]
    pages = [file for file in files if file not in pdfs]
    if max(len(pdfs), len(pages)) > 1:
        raise click.UsageError(f"{files[1]}: a report is one .html and one .pdf: name one of each.")
    return next(iter(pages), None), next(iter(pdfs), None)


def _summary(file: Path, made: Report) -> str:
    kinds = Counter(run.run.kind for run in made.runs)
    runs = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    counts = (("run", len(made.runs)), ("table", made.tables), ("figure", made.figures))
    reported = [f"{count} {word}{'s' * (count != 1)}" for word, count in counts]
    reported[0] += f" ({runs})"
    return f"{file}: {', '.join(reported)}"
