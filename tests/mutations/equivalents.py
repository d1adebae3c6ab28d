"""Equivalent mutants: wrong signs that change no motion, each with the reason."""

from typing import NamedTuple

__all__ = ["EQUIVALENTS", "Equivalent"]


class Equivalent(NamedTuple):
    """A mutant that gives the same motion.

    Attributes:
        source: source file, from the package, without its suffix.
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
        *("systems/free_body/dynamics", "free_rotation"),
        "q, w1, w2 = _turn_about_3(q, (omega[0], w2, w3), 0.5 * h * k3 * w3, r12, r21)",
        *("w3", 0, _UNREAD),
    ),
    Equivalent(
        *("systems/free_body/dynamics", "free_rotation"),
        "q, w2, w3 = _turn_about_1(q, (w1, w2, w3), 0.25 * h * k1 * w1, r23, r32)",
        *("w1", 0, _UNREAD),
    ),
    Equivalent(
        *(
            "systems/dynamic_ball/dynamics",
            "step",
            "alpha_x = fma(half, fma(-0.25 * h, u.a_x, rate_x), y.alpha_x)",
        ),
        *("-0.25 * h", 0, _SYMMETRIC),
    ),
    Equivalent(
        *(
            "systems/dynamic_ball/dynamics",
            "step",
            "alpha_y = fma(half, fma(-0.25 * h, u.a_y, rate_y), y.alpha_y)",
        ),
        *("-0.25 * h", 0, _SYMMETRIC),
    ),
    Equivalent(
        *("systems/dynamic_ball/dynamics", "step"),
        "middle = State(*attitude(y), X, Y, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)",
        *("alpha_x", 0, _UNREAD),
    ),
    Equivalent(
        *("systems/dynamic_ball/dynamics", "step"),
        "middle = State(*attitude(y), X, Y, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)",
        *("alpha_y", 0, "it changes the sign of w . n only, which ball_rate does not read"),
    ),
    Equivalent(
        *("systems/dynamic_ball/dynamics", "_kick", "after = moving(y, y.X, y.Y, vx, vy, spin)"),
        *("spin", 0, _UNREAD),
    ),
    *(
        Equivalent(
            *("systems/rolling_disk/dynamics", "invariants"),
            "wn, wl = fma(n1, y.omega1, n2 * y.omega2), fma(n1, y.omega2, -n2 * y.omega1)",
            *(term, 0, _SQUARED),
        )
        for term in ("fma(n1, y.omega1, n2 * y.omega2)", "fma(n1, y.omega2, -n2 * y.omega1)")
    ),
    Equivalent(
        *("systems/rolling_disk/dynamics", "invariants", "w3 = y.omega3"),
        *("y.omega3", 0, _SQUARED),
    ),
    Equivalent(
        *("systems/roller/dynamics", "invariants", "sunk = y.s * mean * sine_ratio(x)"),
        *("x", 0, "sin(x) / x is even"),
    ),
    Equivalent(
        *("engine/elementary", "module"),
        "_TO_INTEGER = 6755399441055744.0  "
        "# 1.5 * 2**52: adding and subtracting it rounds to an integer",
        *("6755399441055744.0", 0, "numbers about -1.5 * 2**52 are as far apart"),
    ),
    Equivalent(
        *("engine/elementary", "_sincos"),
        "s = fma(z, 1.0 / 355687428096000.0, -1.0 / 1307674368000.0)",
        *("z", 0, "x^17 / 17! is 5e-17 at pi / 4: it is there to be less than a rounding"),
    ),
)
