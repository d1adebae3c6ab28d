"""A figure of the gallery as data: what it shows, the law, the source, how it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Entry", "Number"]


@dataclass(frozen=True)
class Number:
    """A quantity that a figure computes in two ways.

    Attributes:
        what: the quantity; of an error, the two sides that are compared.
        value: as simulated, or the error.
        expected: by theory; 0 for an error.
        bound: largest difference of the two that is allowed.
        unit: of both; empty for a pure number.
    """

    what: str
    value: float
    expected: float
    bound: float
    unit: str = ""

    @property
    def error(self) -> float:
        """Difference of the two values."""
        return abs(self.value - self.expected)

    @property
    def holds(self) -> bool:
        """Whether the difference is within the bound; NaN never is."""
        return self.error <= self.bound

    def __str__(self) -> str:
        """One line: an error alone, or both values and their difference."""
        unit = f" {self.unit}" if self.unit else ""
        if self.expected == 0.0:
            return f"{self.what}: {self.value:.0e}{unit}"
        apart = f"{self.error:.0e}" if self.error else "0"
        return (
            f"{self.what}: {self.value:.6g}{unit} simulated, "
            f"{self.expected:.6g}{unit} by theory, difference {apart}"
        )

    def as_json(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "what": self.what,
            "value": float(self.value),
            "expected": float(self.expected),
            "error": float(self.error),
            "bound": self.bound,
            "unit": self.unit,
            "holds": bool(self.holds),
        }


@dataclass(frozen=True)
class Entry:
    """A figure.

    Attributes:
        name: on the command line, and of the files.
        title: heading of the picture.
        caption: what is seen, in one or two sentences.
        law: equation in plain text.
        source: book or paper of the law.
        draw: draws into an empty figure, and returns the numbers that it shows, the main one first.
        size: width and height [inch].
    """

    name: str
    title: str
    caption: str
    law: str
    source: str
    draw: Callable[[Figure], tuple[Number, ...]]
    size: tuple[float, float] = (7.2, 4.2)

    @property
    def command(self) -> str:
        """The command that makes the figure."""
        return f"rigid-envs gallery {self.name} --out DIR"
