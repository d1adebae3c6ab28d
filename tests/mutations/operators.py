"""Mutants of plain Python: each changes one operator, condition, number, call or sign.

What is only read by people is left alone: texts, annotations, error messages, `__repr__`, and how
the parts of a scene look.
"""

import ast
import hashlib
from dataclasses import dataclass, replace

_COMPARED = {
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is},
    **{ast.In: ast.NotIn, ast.NotIn: ast.In},
}
_REVERSED = {**{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}}
_OTHER = {"min": "max", "any": "all", "minimum": "maximum"}
_OTHER |= {new: old for old, new in _OTHER.items()}
_TEXTS = (ast.JoinedStr, ast.List, ast.ListComp, ast.Tuple)
_LAYOUT = ("__repr__", "__str__")
_SKIPPED = (ast.Assert, ast.Raise, ast.Import, ast.ImportFrom, ast.JoinedStr, ast.pattern)
_LOOKS = ("Arrow", "Camera", "Floor", "Part", "Trace")
_CHECKS = ("require",)  # of their arguments only the first is no text for people
_WIDEST = 72  # characters of an expression that are shown


@dataclass(frozen=True)
class Change:
    """One bug that can be planted in a source file.

    Attributes:
        file: Source file, from the root of the checkout.
        function: Qualified name of the function or class; "module" outside of all.
        line: Line on which the changed code begins.
        text: That line without blanks at its ends.
        what: The code as it is and as it becomes, and which of the equal ones of the line it is.
        new: What becomes of it.
        span: Where it begins and ends in the bytes of the source.
        lines: First and last line of the statement, or of its head.
        in_body: Whether it runs when a function is called, and not when the file is imported.
    """

    file: str
    function: str
    line: int
    text: str
    what: str
    new: str
    span: tuple[int, int]
    lines: tuple[int, int]
    in_body: bool

    @property
    def key(self):
        """Identifies the change as long as its line is not edited."""
        return self.file, self.function, self.text, self.what

    def planted(self, source):
        """The source with this bug."""
        raw, (begin, end) = source.encode(), self.span
        return (raw[:begin] + self.new.encode() + raw[end:]).decode()


def sampled(changes, count, seed):
    """Some of the changes, in their order: those of the least hashes.

    An edit of the sources leaves the others where they are.
    """

    def draw(change):
        return hashlib.sha256(repr((seed, change.key)).encode()).hexdigest()

    return sorted(sorted(changes, key=draw)[:count], key=changes.index)


def changes_of(source, file):
    """All changes of a source file, in the order of its lines.

    Args:
        source: Its text.
        file: Its path from the root of the checkout.
    """
    found = _Finder(source, file)
    found.visit(ast.parse(source))
    return sorted(found.changes, key=lambda change: (change.span, change.what))


def _literal(node):
    """The number that is written there, also with a minus; None for anything else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        number = _literal(node.operand)
        return None if number is None else -number
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value
    return None


def _is_text(node):
    return isinstance(node, _TEXTS) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _is_arithmetic(node):
    """Whether it is a sum, product, power or minus of what can be numbers."""
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.USub)
    return (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, (*_REVERSED, ast.Pow))
        and not (_is_text(node.left) or _is_text(node.right))
    )


class _Finder(ast.NodeVisitor):
    """Walks through a file and notes every change."""

    def __init__(self, source, file):
        self.changes = []
        self._file = file
        self._lines = source.splitlines()
        self._starts = [0]
        for line in source.encode().splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self._names = []
        self._depth = 0  # of functions
        self._extent = (0, 0)

    # places

    def visit(self, node):
        """Keep the extent of the statement, and go on."""
        if isinstance(node, _SKIPPED):
            return
        if not isinstance(node, ast.stmt):
            super().visit(node)
            return
        before = self._extent
        self._extent = (node.lineno, _last_line(node))
        super().visit(node)
        self._extent = before

    def visit_FunctionDef(self, node):
        """Its defaults and its body; no annotation and no decorator."""
        for default in [*node.args.defaults, *node.args.kw_defaults]:
            if default is not None:
                self.visit(default)
        if node.name not in _LAYOUT:
            self._inside(node.name, node.body, 1)

    def visit_ClassDef(self, node):
        """Its body."""
        self._inside(node.name, node.body, 0)

    def _inside(self, name, body, depth):
        self._names.append(name)
        self._depth += depth
        for statement in body:
            self.visit(statement)
        self._depth -= depth
        self._names.pop()

    def visit_AnnAssign(self, node):
        """Its value, not its type."""
        if node.value is not None:
            self.visit(node.value)

    # changes

    def visit_If(self, node):
        """`if c` never, and always where that does more than to raise an error."""
        if ast.unparse(node.test) in ("TYPE_CHECKING", "__name__ == '__main__'"):
            return
        self._condition(node.test, only_raises=all(isinstance(s, ast.Raise) for s in node.body))
        self.generic_visit(node)

    def visit_IfExp(self, node):
        """`a if c else b` is a, or b."""
        self._condition(node.test)
        self.generic_visit(node)

    def _condition(self, test, only_raises=False):
        if not isinstance(test, ast.Constant):
            self._note(test, "False", f"if {ast.unparse(test)}", "if False")
            if not only_raises:
                self._note(test, "True", f"if {ast.unparse(test)}", "if True")

    def visit_Compare(self, node):
        """Another comparison."""
        for k, op in enumerate(node.ops):
            ops = [*node.ops]
            ops[k] = _COMPARED[type(op)]()
            self._put(node, ast.Compare(node.left, ops, node.comparators))
        self.generic_visit(node)

    def visit_BinOp(self, node):
        """The reverse operation."""
        if type(node.op) in _REVERSED and _is_arithmetic(node):
            self._put(node, ast.BinOp(node.left, _REVERSED[type(node.op)](), node.right))
        self.generic_visit(node)

    def visit_AugAssign(self, node):
        """The reverse operation."""
        if type(node.op) in _REVERSED and not _is_text(node.value):
            other = ast.AugAssign(node.target, _REVERSED[type(node.op)](), node.value)
            self._note(node, ast.unparse(other))
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        """`and` is `or`."""
        self._put(
            node, ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
        )
        self.generic_visit(node)

    def visit_UnaryOp(self, node):
        """No `not`; a negative number is a number."""
        if isinstance(node.op, ast.Not):
            self._put(node, node.operand)
        if _literal(node) is None:
            self.generic_visit(node)
        else:
            self._number(node)

    def visit_Constant(self, node):
        """Another number."""
        if _literal(node) is not None:
            self._number(node)

    def _number(self, node):
        number = _literal(node)
        assert number is not None
        more = number + 1 if isinstance(number, int) else 2.0 * number or 1.0
        self._note(node, f"({more!r})", shown=repr(more))

    def visit_Call(self, node):
        """The other end of an order, or of a quantifier."""
        name = node.func
        if isinstance(name, ast.Name) and name.id in _LOOKS:
            return
        if isinstance(name, ast.Name) and name.id in _OTHER:
            self._put(node, ast.Call(ast.Name(_OTHER[name.id]), node.args, node.keywords))
        elif isinstance(name, ast.Attribute) and name.attr in _OTHER:
            other = ast.Attribute(name.value, _OTHER[name.attr])
            self._put(node, ast.Call(other, node.args, node.keywords))
        if isinstance(name, ast.Name) and name.id in _CHECKS:
            self.visit(node.args[0])
        else:
            self.generic_visit(node)

    def visit_Expr(self, node):
        """A call for its effect is left out."""
        if isinstance(node.value, ast.Call):
            self._note(node, "pass")
        self.generic_visit(node)

    def visit_Return(self, node):
        """The returned number has the wrong sign."""
        if node.value is not None and _literal(node.value) is None and _is_arithmetic(node.value):
            negative = ast.unparse(ast.UnaryOp(ast.USub(), node.value))
            self._note(node, f"return {negative}")
        self.generic_visit(node)

    def _put(self, node, other):
        """Note an expression in the place of another."""
        self._note(node, f"({ast.unparse(other)})", shown=ast.unparse(other))

    def _note(self, node, new, old="", shown=""):
        assert node.end_lineno is not None and node.end_col_offset is not None
        begin = self._starts[node.lineno - 1] + node.col_offset
        end = self._starts[node.end_lineno - 1] + node.end_col_offset
        what = f"{_short(old or ast.unparse(node))} -> {_short(shown or new)}"
        change = Change(
            self._file,
            ".".join(self._names) or "module",
            node.lineno,
            self._lines[node.lineno - 1].strip(),
            what,
            new,
            (begin, end),
            self._extent,
            self._depth > 0,
        )
        equal = sum(c.key[:3] == change.key[:3] and c.what.startswith(what) for c in self.changes)
        self.changes.append(replace(change, what=f"{what} ({equal + 1})") if equal else change)


def _last_line(node):
    """The last line of a statement, or of its head if it has a body."""
    body = getattr(node, "body", None)
    return max(node.lineno, body[0].lineno - 1) if body else node.end_lineno or node.lineno


def _short(code):
    code = " ".join(code.split())
    return code if len(code) <= _WIDEST else f"{code[: _WIDEST - 3]}..."
