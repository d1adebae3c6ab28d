"""Files written at once: whoever reads one sees the old or the new, never a part."""

import os
from pathlib import Path

__all__ = ["write"]


def write(file: Path, text: str) -> None:
    """Write a file beside its place, and put it there when it is whole.

    Args:
        file: where.
        text: what, as UTF-8.
    """
    temporary = file.with_name(f".{file.name}.{os.getpid()}.tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)
