"""How the pages become a site: ``make docs``. Sphinx with MyST for Markdown, in the theme Furo; nothing from the net.

The source folder is the whole project, so that links between pages are those that work in any viewer of the repository.
"""

from pathlib import Path
from typing import Any

project = "psvideo"
copyright = "the psvideo authors, Apache 2.0"  # noqa: A001 (Sphinx reads this name)
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "docs/index"
include_patterns = [
    *("docs/*.md", "docs/decisions/*.md", "lights/**.md", "calibration/**.md"),
    *("bench/README.md", "CONTRIBUTING.md", "CHANGELOG.md"),
]
exclude_patterns = [".*", "src", "tests", "docs/_site", "**/build"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "psvideo"
html_copy_source = False
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
nitpicky = True


def _list_decisions(app: Any, page: str, source: list[str]) -> None:
    """Put every decision's page below their list, which other viewers show as it is."""
    if page == "docs/decisions/README":
        names = sorted(path.stem for path in Path(app.srcdir, "docs/decisions").glob("*.md") if path.stem != "README")
        source[0] += "\n```{toctree}\n:hidden:\n" + "\n".join(names) + "\n```\n"


def _list_other_pages(app: Any, page: str, source: list[str]) -> None:
    """Put pages that the index does not name among those on results, so that none is out of reach."""
    if page == "docs/index":
        named = set(source[0].splitlines())
        others = [
            path.stem for path in sorted(Path(app.srcdir, "docs").glob("*.md")) if path.stem not in named | {"index"}
        ]
        source[0] = source[0].replace("\ndepth\n", "\n" + "\n".join(["depth", *others]) + "\n")


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", _list_decisions)
    app.connect("source-read", _list_other_pages)
