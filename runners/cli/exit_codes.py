"""Exit codes beside 0, 1 and 2."""

from __future__ import annotations

INTERRUPTED = 130  # exit code of a shell for Ctrl-C
