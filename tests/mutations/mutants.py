"""All mutants of a source file of compiled functions: each has one wrong sign.

A *term* is what carries a sign of its own: an operand of + or -, an operand of unary minus, a
product as a whole (whichever factor has the wrong sign), the addend of an fma, an argument, an
entry of a tuple, an assigned or returned number. A mutant negates one term. Tuples have no sign;
names that the source shows to be tuples are left out, and what is left of them does not compile.
"""

import ast
import re
from dataclasses import dataclass

_MINUS = (ast.Add, ast.Sub)
_TIMES = (ast.Mult, ast.Div)


@dataclass(frozen=True)
class Mutant:
    """A term that is negated.

    Attributes:
        function: name of the function; "module" outside of all.
        line: number of its first line.
        text: that line of the source, without blanks at its ends.
        term: the term as it is written.
        nth: which of the equal terms of that line it is, from 0.
        span: where it begins and ends in the source.
    """

    function: str
    line: int
    text: str
    term: str
    nth: int
    span: tuple[int, int]

    @property
    def key(self):
        """Identifies the mutant as long as its line is not edited."""
        return self.function, self.text, self.term, self.nth

    def planted(self, source):
        """The source with this one sign wrong."""
        begin, end = self.span
        return f"{source[:begin]}(-({source[begin:end]})){source[end:]}"


def mutants_of(source, leave_out=frozenset()):
    """All mutants of a file, in the order of its lines.

    Functions that are compiled as a whole (`kernel`) only loop over rows and are left out.
    """
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for name, nodes in _places(ast.parse(source)):
        if name in leave_out:
            continue
        for node in nodes:
            begin = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            text = source[starts[node.lineno - 1] : starts[node.lineno]].strip()
            term = re.sub(r"\s+", " ", source[begin:end])
            nth = sum(m.key[:3] == (name, text, term) and m.line == node.lineno for m in found)
            found.append(Mutant(name, node.lineno, text, term, nth, (begin, end)))
    return sorted(found, key=lambda mutant: mutant.span)


def _places(tree):
    """Terms of each function, and of the module itself."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            for function in _compiled(node):
                yield function.name, list(_of_function(function))
        elif isinstance(node, ast.Assign) and _is_arithmetic(node.value):
            yield "module", list(_terms(node.value, True))


def _compiled(node):
    """The function itself, or those that are compiled in the place of another."""
    names = {d.func.id if isinstance(d, ast.Call) else d.id for d in node.decorator_list}
    if "overload" in names:
        return [inner for inner in node.body if isinstance(inner, ast.FunctionDef)]
    return [node] if names & {"scalar", "phase", "routine"} else []


def _is_arithmetic(value):
    """Whether numbers are computed, not tuples, types or texts put together."""
    inside = (ast.Constant, ast.Name, ast.BinOp, ast.operator, ast.Tuple, ast.expr_context)
    joined = (n for n in ast.walk(value) if isinstance(n, ast.BinOp))
    return (
        all(isinstance(node, inside) for node in ast.walk(value))
        and not any(
            isinstance(n.value, str) for n in ast.walk(value) if isinstance(n, ast.Constant)
        )
        and any(isinstance(n, ast.Constant) for n in ast.walk(value))
        and not any(isinstance(side, ast.Tuple) for n in joined for side in (n.left, n.right))
    )


def _is_name(node, name):
    return isinstance(node, ast.Name) and node.id == name


def _of_function(function):
    tuples = _tuples(function)
    for node in ast.walk(function):
        if isinstance(node, ast.Return) and node.value is not None:
            whole = function.returns is not None and _is_name(function.returns, "float")
            value = node.value
        elif isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            whole = isinstance(target, ast.Name) and target.id not in tuples
        else:
            continue
        for term in _terms(value, whole):
            if not (isinstance(term, ast.Name) and term.id in tuples):
                yield term


def _tuples(function):
    """Names that are tuples: annotated as such, assigned one, indexed or unpacked."""
    names = {
        argument.arg
        for argument in function.args.args
        if argument.annotation is not None and not _is_name(argument.annotation, "float")
    }
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.Subscript | ast.Starred) and isinstance(node.value, ast.Name):
            names.add(node.value.id)
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            if isinstance(node.value, ast.Name):
                names.add(node.value.id)
    return names


def _terms(node, whole):
    """Terms in an expression; `whole` says whether it is one itself."""
    if isinstance(node, ast.Tuple):
        for entry in node.elts:
            yield from _terms(entry, not isinstance(entry, ast.Starred | ast.Tuple))
    elif isinstance(node, ast.BinOp) and isinstance(node.op, _MINUS):
        yield from _terms(node.left, True)
        yield from _terms(node.right, True)
    elif isinstance(node, ast.Starred):
        yield from _terms(node.value, False)
    else:
        if whole and not _has_no_sign(node):
            yield node
        yield from _within(node)


def _has_no_sign(node):
    """Whether it is zero, or true or false."""
    either = isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr | ast.BitAnd)
    return _is_zero(node) or isinstance(node, ast.Compare) or either


def _is_zero(node):
    return isinstance(node, ast.Constant) and node.value == 0.0


def _within(node):
    """Terms inside something that has one sign: a product, a power, a call."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, _TIMES):
        yield from _terms(node.left, False)
        yield from _terms(node.right, False)
    elif isinstance(node, ast.BinOp):  # a power, or one condition or the other
        yield from _terms(node.left, False)
        yield from _terms(node.right, not isinstance(node.right, ast.Constant | ast.Compare))
    elif isinstance(node, ast.UnaryOp):
        yield from _terms(node.operand, False)
    elif isinstance(node, ast.Call):
        # of the two factors of an fma one stands for the product; sizes and conditions have no sign
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        without = {"fma": 1, "abs": 0, "select": 0}.get(name, -1)
        for k, argument in enumerate(node.args):
            yield from _terms(argument, not isinstance(argument, ast.Tuple) and k != without)
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        # equal to zero is what the negative is, too
        ordered = not (isinstance(node.ops[0], ast.Eq | ast.NotEq) and any(map(_is_zero, sides)))
        for side in sides:
            yield from _terms(side, ordered)
    elif isinstance(node, ast.IfExp):
        for part in (node.test, node.body, node.orelse):
            yield from _terms(part, part is not node.test)
    elif isinstance(node, ast.Subscript) and isinstance(node.value, ast.Call):
        yield from _terms(node.value, False)
