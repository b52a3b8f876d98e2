"""Reports of runs, made of their files and of nothing else.

In goes a folder with runs, which may be damaged or anybody's.  Out comes one HTML file, with the
raw data as CSV beside it, or a PDF.  Begin with `lab_report`, or with `run_report` for one run:

find_runs   the runs in a folder; `report_run`, `lone_files` and `run_files` read one
compose     runs to a document: numbered tables and figures
method      aim, method and questions by the kinds of runs
set_up      the arms of the runs, as tables
raw_figures figures that a report draws itself
print_pdf   HTML to PDF, by a browser
"""
