"""The documentation's site, for Sphinx.

.uv/bin/uv run --group docs sphinx-build -W laptop/docs site
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # what the reference is read from

from shared.version import VERSION  # noqa: E402

project = "BrickServo"
author = "BrickServo contributors"
copyright = "BrickServo contributors, MIT licence"
release = version = VERSION

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
]
myst_heading_anchors = 3  # as GitHub makes them
myst_enable_extensions = ["dollarmath"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries = False
smartquotes = False  # it would make one dash of two, also of those before an option

html_theme = "furo"
html_title = f"BrickServo {VERSION}"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b62a3", "color-brand-content": "#0b62a3"},
    "dark_css_variables": {"color-brand-primary": "#7cc0f2", "color-brand-content": "#7cc0f2"},
}
