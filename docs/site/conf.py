"""The pages of ``docs/`` as a site that needs no network, and opens without a server.

    sphinx-build -W -j auto -b html -c docs/site docs build/site

``-W`` makes a link that leads nowhere, a page that nothing leads to, or a docstring that cannot be read a failure.
"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

project = "erls"
author = copyright = "the erls contributors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "notebook_pages", "equation_numbers"]
exclude_patterns = ["site"]
nitpicky = False  # types of other packages have no pages here

html_theme = "furo"
html_title = "erls"
html_show_sourcelink = False
html_copy_source = False

myst_heading_anchors = 4  # as GitHub names them

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "imported-members": True, "inherited-members": True}
napoleon_google_docstring = False
napoleon_use_rtype = False
