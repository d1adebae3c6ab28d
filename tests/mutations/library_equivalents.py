"""Bugs in the library that no test can notice, and why."""

from typing import NamedTuple

__all__ = ["EQUIVALENTS", "Equivalent"]


class Equivalent(NamedTuple):
    """A change that makes no difference that a user could see.

    Attributes:
        file: Source file, from the root of the checkout.
        function: Qualified name of the function or class; "module" outside of all.
        text: Line of the source, without blanks at its ends.
        what: The code as it is and as it becomes.
        why: Why no test can notice it.
    """

    file: str
    function: str
    text: str
    what: str
    why: str

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Identifies the change, as `Change.key`."""
        return self[:4]


_BODIES = "rigid_envs/bodies/"

EQUIVALENTS: tuple[Equivalent, ...] = (
    Equivalent(
        f"{_BODIES}mesh.py",
        "_check_volume",
        'require(volume > 0.0, volume, "volume", expected)',
        "volume > 0.0 -> volume >= 0.0",
        "a volume of 0 has been refused as flat",
    ),
)
