"""What the pages need beside mkdocs: formulas written as on code hosts, $`x`$ and ```math, for the site's MathJax."""

from __future__ import annotations

import re

INLINE = re.compile(r"\$`(.+?)`\$", re.S)
ROLE = re.compile(r":(?:func|meth|class|attr|data|mod):(?=\s*<code>)")
BLOCK = re.compile(r"^( *)```math\n(.*?)^ *```$", re.S | re.M)


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return a page with its formulas as arithmatex reads them."""
    blocks = BLOCK.sub(lambda m: f"{m[1]}$$\n{m[2]}{m[1]}$$", markdown)
    return INLINE.sub(lambda m: f"${m[1].strip()}$", blocks)


def on_page_content(html: str, **_: object) -> str:
    """Return a page without the roles that docstrings give names for other tools, such as :func:."""
    return ROLE.sub("", html)
