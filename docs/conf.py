"""Settings of the site: `make docs` builds it in docs/_build/html."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tomllib
from pathlib import Path

import jupyter_server_mathjax
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
BUILD = DOCS / "_build"
sys.path.insert(0, str(DOCS / "_ext"))

PROJECT = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
project = "wearsim"
author = "The wearsim team"
copyright = author  # noqa: A001
release = version = PROJECT["version"]
needs_sphinx = "8.0"

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_design",
    "groove_pressure",
    "wearsim_measurements",
    "wearsim_reference",
]
exclude_patterns = ["_build", "_static", "_templates", "**/.ipynb_checkpoints"]
templates_path = ["_templates"]
highlight_language = "none"
default_role = "autolink"
# notebooks load `notebook_pages`, and call the command wearsim of this environment
for name, folders in {
    "PATH": [Path(sys.executable).parent],
    "PYTHONPATH": [DOCS / "_ext", DOCS.parent],
}.items():
    given = filter(None, [os.environ.get(name)])
    os.environ[name] = os.pathsep.join([*map(str, folders), *given])

# links to other projects need a network; elsewhere they are plain names
if os.environ.get("WEARSIM_DOCS_ONLINE"):
    extensions.append("sphinx.ext.intersphinx")
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
        "pandas": ("https://pandas.pydata.org/docs", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
    }


def _sources_digest() -> str:
    """Return a digest of the package, so that notebooks run again where it has changed."""
    digest = hashlib.sha256()
    for path in sorted((DOCS.parent / "wearsim").rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "attrs_inline"]
myst_heading_anchors = 4

nb_execution_mode = "cache"
nb_execution_cache_path = str(BUILD / "notebooks" / _sources_digest())
nb_execution_in_temp = True
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True

autosummary_generate = ["reference/generated/python.md"]  # written before the build
autodoc_typehints = "none"  # the docstrings have them
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# MathJax without a network: the parts that draw TeX with fonts of their own
MATHJAX_PARTS = (
    "MathJax.js",
    "LICENSE",
    "config/TeX-AMS-MML_HTMLorMML-full.js",
    "extensions",
    "fonts",
    "jax/element",
    "jax/input/TeX",
    "jax/output/HTML-CSS",
    "localization/en",
)


def _mathjax() -> Path:
    """Return a folder with these parts of MathJax, for the static files of the site."""
    source = Path(jupyter_server_mathjax.__file__).parent / "static"
    target = BUILD / "static"
    for part in MATHJAX_PARTS:
        place = target / "mathjax" / part
        if place.exists():
            continue
        place.parent.mkdir(parents=True, exist_ok=True)
        if (source / part).is_dir():
            shutil.copytree(source / part, place, ignore=shutil.ignore_patterns("a11y"))
        else:
            shutil.copy(source / part, place)
    # an empty font that browsers load without an error
    combined = target / "mathjax" / "config" / "TeX-AMS-MML_HTMLorMML-full.js"
    text = combined.read_text(encoding="utf-8")
    combined.write_text(text.replace("about:blank", "data:font/woff,"), encoding="utf-8")
    return target


mathjax_path = "mathjax/MathJax.js"
mathjax2_config = {
    "config": ["TeX-AMS-MML_HTMLorMML-full.js"],
    "tex2jax": {"processClass": "math|output_area"},  # MyST excludes the other text
    "HTML-CSS": {"availableFonts": [], "webFont": "STIX-Web", "imageFont": None},
    "menuSettings": {"zoom": "None"},
    "showMathMenu": False,
    "messageStyle": "none",
}

html_theme = "pydata_sphinx_theme"
html_title = "wearsim"
html_static_path = ["_static", str(_mathjax())]
html_css_files = ["wearsim.css"]
html_js_files = ["wearsim.js"]
html_favicon = "_static/wearsim.svg"
html_show_sourcelink = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "collapse_navigation": True,
    "header_links_before_dropdown": 7,
    "navigation_with_keys": False,
    "secondary_sidebar_items": [],  # figures are wide; the contents are below the navigation
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"**": ["sidebar-nav-bs", "page-toc"], "index": [], "start": ["page-toc"]}

linkcheck_timeout = 20
linkcheck_retries = 2
linkcheck_anchors = False


def _registered(_app: Sphinx, uri: str) -> str | None:
    """Return the address at which doi.org says whether a DOI exists; publishers refuse programs."""
    start = "https://doi.org/"
    return uri.replace(start, f"{start}api/handles/", 1) if uri.startswith(start) else None


def setup(app: Sphinx) -> None:
    """Register how DOIs are checked."""
    app.connect("linkcheck-process-uri", _registered)
