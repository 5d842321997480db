"""The templates of all generated C: one environment, in which names and units stay inside their comments."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2


def render(template: str, **values: object) -> str:
    """Return a template filled in.

    Parameters
    ----------
    template : str
        File in codegen/templates/.
    values : objects
        By name; one that the template asks for and is not given is an error.
    """
    return _environment().get_template(template).render(values)


def comment(text: object) -> str:
    """Return a text that stays inside a C comment, whatever it holds: a name or unit of a user's own system."""
    one_line = "".join(c if c.isprintable() else " " for c in str(text))
    # a backslash, or its trigraph, joins lines
    return one_line.replace("\\", "|").replace("??/", "? ? |").replace("*/", "* /").replace("/*", "/ *")


@cache
def _environment() -> jinja2.Environment:
    import jinja2  # asked for only where C is written

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ascentwind.codegen"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["comment"] = comment
    return environment
