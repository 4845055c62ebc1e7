"""How the pages become a site: ``make docs``. Sphinx with MyST for Markdown, in the theme Furo; nothing from the net.

The source folder is the whole project, so that links between pages are those that work in any viewer of the repository.
"""

import ast
import dataclasses
import inspect
import textwrap
from pathlib import Path
from typing import Any

project = "psvideo"
copyright = "the psvideo authors, Apache 2.0"  # noqa: A001 (Sphinx reads this name)
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
napoleon_google_docstring = False
napoleon_use_ivar = True
source_suffix = {".md": "markdown"}
root_doc = "docs/index"
include_patterns = [
    *("docs/*.md", "docs/decisions/*.md", "lights/**.md", "calibration/**.md"),
    *("bench/README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md"),
]
exclude_patterns = [".*", "src", "tests", "docs/_site", "**/build"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "psvideo"
html_copy_source = False
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
python_maximum_signature_line_length = 88  # longer ones: a parameter a line
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages: nothing from the net, so no inventories


def _signature(app: Any, what: str, name: str, obj: Any, *_: Any) -> tuple[str, str | None] | None:
    """Give signatures as they stand in the source: numpy's ArrayLike and our own choices by their names."""
    source = ast.parse(textwrap.dedent(inspect.getsource(obj))).body[0]
    if isinstance(source, ast.FunctionDef):
        return f"({ast.unparse(source.args)})", ast.unparse(source.returns) if source.returns else None
    if isinstance(source, ast.ClassDef) and dataclasses.is_dataclass(obj):
        fields = [ast.unparse(node) for node in source.body if isinstance(node, ast.AnnAssign)]
        fields = fields if "_: KW_ONLY" in fields else ["_: KW_ONLY", *fields]
        return f"({', '.join('*' if field == '_: KW_ONLY' else field for field in fields)})", None
    return None


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
    app.connect("autodoc-process-signature", _signature)
    app.connect("source-read", _list_decisions)
    app.connect("source-read", _list_other_pages)
