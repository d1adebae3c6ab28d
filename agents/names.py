"""Names that are safe as names of folders."""

from __future__ import annotations

import re

__all__ = ["is_name"]

_NAME = re.compile(r"[A-Za-z0-9._-]{1,80}")


def is_name(text: str) -> bool:
    """Whether a text is 1 to 80 letters, digits, dots, dashes or underscores, and no `.` or `..`.

    Args:
        text: The text.
    """
    return _NAME.fullmatch(text) is not None and text.strip(".") != ""
