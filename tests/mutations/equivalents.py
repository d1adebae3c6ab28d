"""Equivalent mutants: wrong signs that change no motion, each with the reason."""

from typing import NamedTuple

__all__ = ["EQUIVALENTS", "Equivalent"]


class Equivalent(NamedTuple):
    """A mutant that gives the same motion.

    Attributes:
        source: name of the source file.
        function: name of the function.
        text: the line as it is written, without blanks at its ends.
        term: the term on that line.
        nth: which of the equal terms of the line, from 0.
        reason: why the negated term gives the same motion.
    """

    source: str
    function: str
    text: str
    term: str
    nth: int
    reason: str


_UNREAD = "it is handed on to a function that does not read it"
_SQUARED = "it is squared and nothing else"
_SYMMETRIC = (
    "at half time the plate is taken h^2 a / 4 too far, forth as well as back: the step stays "
    "symmetric, so what is left of its error after composition is of the same order and size"
)

EQUIVALENTS: tuple[Equivalent, ...] = (
    Equivalent(
        *("free_body", "free_rotation"),
        "q, w1, w2 = _turn_about_3(q, (omega[0], w2, w3), 0.5 * h * k3 * w3, r12, r21)",
        *("w3", 0, _UNREAD),
    ),
    Equivalent(
        *("free_body", "free_rotation"),
        "q, w2, w3 = _turn_about_1(q, (w1, w2, w3), 0.25 * h * k1 * w1, r23, r32)",
        *("w1", 0, _UNREAD),
    ),
    Equivalent(
        *("dynamic_ball", "rhs", "plate = plate_rate((y[9], y[10], y[11], y[12]))"),
        *("y[9]", 0, _UNREAD),
    ),
    Equivalent(
        *("dynamic_ball", "step", "alpha_x = fma(half, fma(-0.25 * h, u[2], rate_x), y[9])"),
        *("-0.25 * h", 0, _SYMMETRIC),
    ),
    Equivalent(
        *("dynamic_ball", "step", "alpha_y = fma(half, fma(-0.25 * h, u[3], rate_y), y[10])"),
        *("-0.25 * h", 0, _SYMMETRIC),
    ),
    *(
        Equivalent(
            *("dynamic_ball", "step"),
            "middle = (*q, x, y_, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)",
            *(term, 0, _UNREAD),
        )
        for term in ("alpha_x", "alpha_y", "rate_x", "rate_y")
    ),
    Equivalent(
        *("dynamic_ball", "step"),
        "omega = ball_rate(middle, plate_rate((alpha_x, alpha_y, rate_x, rate_y)), p)",
        *("alpha_x", 0, _UNREAD),
    ),
    Equivalent(
        *("dynamic_ball", "step"),
        "omega = ball_rate(middle, plate_rate((alpha_x, alpha_y, rate_x, rate_y)), p)",
        *("alpha_y", 0, "it changes the sign of w . n only, which ball_rate does not read"),
    ),
    Equivalent(
        *("dynamic_ball", "_kick", "plate = plate_rate((y[9], y[10], y[11], y[12]))"),
        *("y[9]", 0, _UNREAD),
    ),
    Equivalent(
        *("dynamic_ball", "_kick", "after = (*y[:6], vx, vy, spin, *y[9:])"),
        *("spin", 0, _UNREAD),
    ),
    *(
        Equivalent(
            *("rolling_disk", "invariants"),
            "wn, wl, w3 = fma(n1, y[4], n2 * y[5]), fma(n1, y[5], -n2 * y[4]), y[6]",
            *(term, 0, _SQUARED),
        )
        for term in ("fma(n1, y[4], n2 * y[5])", "fma(n1, y[5], -n2 * y[4])", "y[6]")
    ),
    Equivalent(
        *("roller", "invariants", "sunk = y[0] * mean * ratio(x)"),
        *("x", 0, "sin(x) / x is even"),
    ),
    Equivalent(
        *("elementary", "module"),
        "_TO_INTEGER = 6755399441055744.0  "
        "# 1.5 * 2**52: adding and subtracting it rounds to an integer",
        *("6755399441055744.0", 0, "numbers about -1.5 * 2**52 are as far apart"),
    ),
    Equivalent(
        *("elementary", "_sincos"),
        "s = fma(z, 1.0 / 355687428096000.0, -1.0 / 1307674368000.0)",
        *("z", 0, "x^17 / 17! is 5e-17 at pi / 4: it is there to be less than a rounding"),
    ),
)
