"""What the functions of a system or a task return, compared with what the loops take."""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import types

from rigid_envs.engine.compiler import returned_type

# The loops write the numbers of a row one after the other to the memory of its slots: a row that is
# too long, or another one, would be written all the same.


class Returns(NamedTuple):
    """A function, and what a loop takes from it.

    Attributes:
        name: of the function, in the definition of the system or the task.
        function: it, compiled by `scalar`.
        arguments: examples of its arguments.
        expected: an example of what it returns: a number, a bool, a row, or a tuple of these.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    expected: Any

    def check(self) -> None:
        """Refuse a function that returns something else.

        Raises:
            TypeError: it does.
        """
        found = returned_type(self.function, *self.arguments)
        if found is None or _fits(found, self.expected):
            return
        where = f"{self.function.__module__}.{self.function.__name__}"
        raise TypeError(
            f"{self.name} = {where}, which returns {_told(found)}; expected a function that "
            f"returns {_wanted(self.expected)}: return exactly these, in this order"
        )


def _fits(found: Any, expected: Any) -> bool:
    """Whether a type is that of an example; a row may also be a tuple of as many numbers."""
    if not isinstance(expected, tuple):
        numbers = types.Integer if isinstance(expected, bool) else types.Number
        return isinstance(found, (types.Boolean, numbers))
    if isinstance(found, types.BaseNamedTuple) and hasattr(expected, "_fields"):
        return found.instance_class is type(expected)
    fits = isinstance(found, types.BaseTuple) and len(found) == len(expected)
    return fits and all(map(_fits, found, expected))


def _told(found: Any) -> str:
    """A type in words."""
    if isinstance(found, types.BaseNamedTuple):
        return str(found.instance_class.__name__)
    if isinstance(found, types.BaseTuple):
        return f"({', '.join(map(_told, found))})"
    if isinstance(found, types.Boolean):
        return "bool"
    return "number" if isinstance(found, types.Number) else str(found)


def _wanted(expected: Any) -> str:
    """An example in words."""
    if hasattr(expected, "_fields"):
        return f"{type(expected).__name__}({', '.join(expected._fields)})"
    if isinstance(expected, tuple):
        return f"({', '.join(map(_wanted, expected))})"
    return "bool" if isinstance(expected, bool) else "number"
