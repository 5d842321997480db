"""The version that is installed; apart, because asking for it takes longer than everything else at the front door."""

from importlib.metadata import version

__version__ = version("ascentwind")
