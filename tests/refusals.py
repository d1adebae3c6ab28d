"""Refusals and their grammar: `name = value; expected what it can be: how to mend it`."""

import math
import re

import numpy as np
import pytest

NAME = r"[A-Za-z][\w.]*(\([\w.]+\))?(\[[^\]]*\])?"
GRAMMAR = re.compile(rf"([^;]+: )?{NAME} (= .+|has shape \([\d, ]*\)); expected [^;]+", re.DOTALL)
NO_NUMBERS = [True, np.True_, math.nan, math.inf, "1", None, 1j, [[1.0], [1.0, 2.0]]]
NO_SCALARS = [*NO_NUMBERS, [1.0], np.ones(2)]


def refusal(call, *args, **kwargs):
    """The message with which arguments are refused, which obeys the grammar."""
    with pytest.raises(ValueError) as refused:
        call(*args, **kwargs)
    text = str(refused.value)
    assert GRAMMAR.fullmatch(text), text
    return text


def refuses(message, call, /, *args, **kwargs):
    """Arguments are refused with a message that obeys the grammar and holds this pattern."""
    text = refusal(call, *args, **kwargs)
    assert re.search(message, text), text
