"""Fewer operations for the same numbers: products, quotients and roots seen as products of powers.

Every number of a graph is a coefficient times powers of atoms. An atom is a sum, an input, or the result of any other
operation; exponents count halves, so that roots take part. On that sight:

- what stands above and below a line cancels, and (x r)^2 with r = 1/sqrt(s) is x^2/s, without a root
- common factors leave a sum: r x + r y is r (x + y)
- a sum with a quotient in it gets a common denominator: 1 + a/b is (b + a)/b
- a product of quotients is divided once
- what depends on parameters alone is multiplied first, and leaves the loops

The result is the same but for rounding: a product keeps the relative error of its factors, and a sum that relative to
its terms, for no sum is ever multiplied out. Products of more than `TOGETHER` powers are divided in steps, so that
small numbers do not vanish, and what may be as large as the dtype allows (`WIDE`), or as small as a number that only
keeps it from being 0 (`GUARD`), is moved into no other term. Only what is not 0 cancels, by its form or by the masks
that a result is taken under (a cosine above the horizon): 0/0 stays NaN.

Common denominators may cost more than they save, and so may a product that is computed once for several others: all
four are tried, and the graph of least cost is kept, the one that was given among them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

from ..arrays.ops import OPERATIONS
from .costs import Choice, GraphFacts
from .graph import REAL, Graph

TOGETHER = {"float32": 4, "float64": 24}
"""Powers in the divisor of one division, at most."""

GUARD = {"float32": 1e-18, "float64": 1e-150}
"""A number below this, added to a sum so that it is not 0, vanishes when the sum is squared."""

BOUNDED = frozenset(name for name, row in OPERATIONS.items() if row.bounded)
WIDE = frozenset(name for name, row in OPERATIONS.items() if row.wide)
"""Operations whose results are never large, and those whose results may be as large as the dtype allows."""

Nodes = frozenset[int] | None
Facts = tuple[Nodes, Nodes]
NONE = frozenset[int]()

Powers = tuple[tuple[int, int], ...]
"""Atoms in order, each with its exponent in halves, not 0."""


class Product(NamedTuple):
    """A coefficient times powers of atoms."""

    coefficient: float
    powers: Powers


def fewer_operations(
    graph: Graph, outputs: Sequence[int], dtype: str, fixed: Collection[int] = ()
) -> tuple[Graph, list[int]]:
    """A graph that computes `outputs` with fewer operations, and its outputs.

    `fixed`: the numbers of arrays whose entries are the same along the inner axis.
    """
    view = GraphFacts(graph, outputs, fixed)
    made = [(graph, list(outputs)), *(_Rewriting(view, choice, dtype).result() for choice in view.choices())]
    return min(made, key=view.cost)


class _Atom(NamedTuple):
    """A number that is no product: a sum of two products, the value of one, or an operation on some."""

    operation: str
    products: tuple[Product, ...]
    node: int  # the node of the graph that it stands for; for a sum -1, for there may be several
    varies: bool  # along the inner axis
    positive: Nodes  # or 0, or NaN: the nodes that must be above 0 for that; None where nothing tells
    nonzero: Nodes  # the same for its not being 0
    wide: bool


class _Factor(NamedTuple):
    """A factor of a product that is written: its node, how many outputs depend on it, for how many powers it stands."""

    node: int
    reach: int
    weight: int


class _Rewriting:
    """A graph seen as products of powers of atoms, and the graph that is written from them."""

    def __init__(self, view: GraphFacts, choice: Choice, dtype: str):
        self.view, self.choice, self.graph, self.new = view, choice, view.graph, Graph()
        self.together, self.guard = TOGETHER[dtype], GUARD[dtype]
        self.products: dict[int, Product] = {}  # of the nodes of the graph
        self.atoms: list[_Atom] = []
        self.numbers: dict[tuple[object, ...], int] = {}  # of the atoms
        self.tested: dict[int, int] = {}  # atom -> the node, among those that are above 0 somewhere, that it is
        self.written: dict[int, int] = {}  # atom -> node of the new graph
        self.values: dict[Product, int] = {}

    def result(self) -> tuple[Graph, list[int]]:
        for node in self.view.order:
            product = self.products[node] = self._product(node)
            if node in self.view.asked and product.coefficient == 1.0 and [e for _, e in product.powers] == [2]:
                self.tested[product.powers[0][0]] = node
        ends = [self.products[node] for node in self.view.outputs]
        reach = self._reach(ends)
        self.reach = [bits.bit_count() for bits in reach]
        used = [k for k, bits in enumerate(reach) if bits]
        wanted = {*ends, *(product for k in used for product in self.atoms[k].products)}
        self.outputs = len(set(ends))
        divided = [product for product in wanted if any(e < 0 for _, e in product.powers)]
        self.rooted = {k for product in divided for k, e in product.powers if e < 0 and e % 2 and self.atoms[k].varies}
        self.divisors = Counter(divisor for divisor in map(self._divisor, divided) if divisor)
        for k in used:
            self.written[k] = self._write(self.atoms[k])
        return self.new, [self._value(product) for product in ends]

    # Reading.

    def _product(self, node: int) -> Product:
        operation = self.graph.operations[node]
        inputs = [self.products[n] for n in self.view.sources[node]]
        made = None
        if self.graph.kinds[node] == REAL:
            if operation == "mul":
                made = self._multiply(inputs[0], inputs[1], node)
            elif operation == "div":
                made = self._multiply(inputs[0], _inverse(inputs[1]), node)
            elif operation == "add":
                made = self._sum(inputs[0], inputs[1], node)
            elif operation == "sub":
                made = self._sum(inputs[0], _opposite(inputs[1]), node)
            elif operation == "neg":
                return _opposite(inputs[0])
            elif operation == "sqrt":
                made = self._root(inputs[0], node)
            elif operation == "constant":
                value = self.graph.arguments[node][0]
                if value and math.isfinite(value):
                    return Product(value, ())
        if made is None or not _ordinary(made.coefficient):
            return self._atom(operation, tuple(inputs), node)
        if node in self.choice.kept and len(made.powers) > 1:
            return self._atom("value", (made,), -1)
        return made

    def _atom(self, operation: str, products: tuple[Product, ...], node: int) -> Product:
        number = len(self.atoms)
        if node < 0:  # of several nodes, each of which would make it
            key = (operation, *(sorted(products) if operation == "sum" else products))
            number = self.numbers.setdefault(key, number)
        if number == len(self.atoms):
            self.atoms.append(_Atom(operation, products, node, *self._nature(operation, products, node)))
        return Product(1.0, ((number, 2),))

    def _nature(self, operation: str, products: tuple[Product, ...], node: int) -> tuple[bool, Nodes, Nodes, bool]:
        """What an atom is: varying, positive, nonzero, wide."""
        if operation == "load":
            return self.graph.arguments[node][0] not in self.view.fixed, None, None, False
        if operation in ("state", "loop", "result", "rays"):
            return True, None, None, True
        if operation == "constant":
            value = self.graph.arguments[node][0]
            return False, NONE if value >= 0 else None, None, not math.isfinite(value)
        varies = wide = False
        for product in products:
            for k, _ in product.powers:
                atom = self.atoms[k]
                varies, wide = varies or atom.varies, wide or atom.wide
        if operation == "sum":  # with a number so small, its reciprocal may be large
            wide = wide or any(not p.powers and abs(p.coefficient) < self.guard for p in products)
        wide = operation in WIDE or (wide and operation not in BOUNDED)
        facts = _FACTS.get(operation)
        return varies, *(facts(self, products) if facts else (None, None)), wide

    def _of_sum(self, products: Sequence[Product]) -> Facts:
        a, b = products
        positive = self._positive(a)
        if positive is None or (other := self._positive(b)) is None:
            return None, None
        positive |= other
        return positive, _all((positive, _any((self._nonzero(a), self._nonzero(b)))))

    def _of_minimum(self, products: Sequence[Product]) -> Facts:
        positive = _all(self._positive(p) for p in products)
        return positive, None if positive is None else _all((positive, *(self._nonzero(p) for p in products)))

    def _of_maximum(self, products: Sequence[Product]) -> Facts:
        positive = [self._positive(p) for p in products]
        above = [_all((fact, self._nonzero(p))) for fact, p in zip(positive, products, strict=True)]
        return _any(positive), _any(above)

    def _of_choice(self, products: Sequence[Product]) -> Facts:
        return _all(self._positive(p) for p in products[1:]), _all(self._nonzero(p) for p in products[1:])

    def _positive(self, product: Product) -> Nodes:
        """The nodes that must be above 0 for a product to be positive, or 0."""
        if product.coefficient < 0:
            return None
        total = NONE
        for k, e in product.powers:
            if e % 4 == 2:
                nodes = self._fact(self.atoms[k].positive, k)
                if nodes is None:
                    return None
                total |= nodes
        return total

    def _nonzero(self, product: Product) -> Nodes:
        total = NONE
        for k, _ in product.powers:
            nodes = self._fact(self.atoms[k].nonzero, k)
            if nodes is None:
                return None
            total |= nodes
        return total

    def _fact(self, facts: Nodes, atom: int) -> Nodes:
        """What a fact about an atom needs, which follows from its being above 0, too."""
        test = self.tested.get(atom)
        return facts if test is None or (facts is not None and len(facts) < 2) else frozenset((test,))

    def _multiply(self, a: Product, b: Product, node: int) -> Product | None:
        """The product of two; None where it has a factor above the line and below it that may be 0 at the node."""
        other, facts = dict(b.powers), self.view.above_zero[node]
        opposite = [k for k, e in a.powers if other.get(k, 0) * e < 0]
        if not opposite:
            return _times(a, b)
        needed = [(k, self._fact(self.atoms[k].nonzero, k)) for k in opposite]
        doubtful = {k for k, nodes in needed if nodes is None or not nodes <= facts}
        if any(self.atoms[k].varies for k in doubtful):
            return None
        if doubtful:  # parameters, whose quotient is computed once
            apart = self._atom("value", (Product(1.0, tuple((k, other[k]) for k in sorted(doubtful))),), -1)
            b = _times(Product(b.coefficient, tuple(p for p in b.powers if p[0] not in doubtful)), apart)
        return _times(a, b)

    def _root(self, product: Product, node: int) -> Product | None:
        """The square root as a product; None where a factor may be negative, or would get a quarter."""
        if not product.powers or product.coefficient <= 0 or any(e % 2 for _, e in product.powers):
            return None
        needed = self._positive(Product(1.0, tuple((k, 2) for k, _ in product.powers)))
        if needed is None or not needed <= self.view.above_zero[node]:
            return None
        return Product(math.sqrt(product.coefficient), tuple((k, e // 2) for k, e in product.powers))

    def _sum(self, a: Product, b: Product, node: int) -> Product:
        left, right, scale, common = a, b, 1.0, self._common(a.powers, b.powers, node in self.choice.joined)
        if common:
            inverse = _inverse(Product(1.0, common))
            left, right = _times(a, inverse), _times(b, inverse)
        if left.powers or right.powers:
            if abs(left.coefficient) == abs(right.coefficient):
                scale = left.coefficient
                left, right = Product(1.0, left.powers), Product(right.coefficient / scale, right.powers)
            return _times(Product(scale, common), self._atom("sum", (left, right), -1))
        total = left.coefficient + right.coefficient
        return Product(total, common) if total else self._atom("sum", (a, b), -1)

    def _common(self, first: Powers, second: Powers, joined: bool) -> Powers:
        """What both terms of a sum have as a factor; if they are to be joined, with a common denominator."""
        a, b = dict(first), dict(second)
        if not joined:
            return tuple((k, min(e, b[k]) if e > 0 else max(e, b[k])) for k, e in first if b.get(k, 0) * e > 0)
        powers = []
        for k in sorted(a.keys() | b.keys()):
            e, f = a.get(k, 0), b.get(k, 0)
            if min(e, f) < 0 and self.atoms[k].varies and not self.atoms[k].wide:
                powers.append((k, min(e, f)))
            elif e * f > 0:
                powers.append((k, min(e, f) if e > 0 else max(e, f)))
        return tuple(powers)

    # Writing.

    def _reach(self, ends: Sequence[Product]) -> list[int]:
        """For each atom the outputs that depend on it, as bits: what channels share is multiplied first, and once."""
        reach = [0] * len(self.atoms)
        for i, product in enumerate(ends):
            for k, _ in product.powers:
                reach[k] |= 1 << i
        for k in reversed(range(len(self.atoms))):
            bits = reach[k]
            for product in self.atoms[k].products if bits else ():
                for below, _ in product.powers:
                    reach[below] |= bits
        return reach

    def _write(self, atom: _Atom) -> int:
        operation, products, node = atom.operation, atom.products, atom.node
        if operation == "value":
            return self._value(products[0])
        if operation == "sum":
            a, b = products if products[0].coefficient > 0 else products[::-1]
            if b.coefficient > 0 or a.coefficient < 0:
                return self.new.apply("add", self._value(a), self._value(b))
            return self.new.apply("sub", self._value(a), self._value(_opposite(b)))
        return self.graph.copied(node, self.new, [self._value(product) for product in products])

    def _value(self, product: Product) -> int:
        """A node of the new graph."""
        coefficient, powers = product
        if not powers:
            return self.new.constant(coefficient)
        if coefficient == 1.0 and len(powers) == 1 and powers[0][1] == 2:
            return self.written[powers[0][0]]
        if product not in self.values:
            self.values[product] = self._quotient_of(coefficient, powers)
        return self.values[product]

    def _quotient_of(self, coefficient: float, powers: Powers) -> int:
        """A node for a product of some powers."""
        fixed = tuple(p for p in powers if not self.atoms[p[0]].varies)
        varying = tuple(p for p in powers if self.atoms[p[0]].varies) if fixed else powers
        above, below = self._factors(varying, 1), self._factors(varying, -1)
        if below and self.divisors[self._divisor(Product(coefficient, varying))] > 1:
            above.append(_Factor(self._quotient([], below), 0, 1))
            below = []
        negative = coefficient < 0 and bool(above)
        scale = self._scale(abs(coefficient) if above else coefficient, fixed)
        if scale is not None:
            shared = [f for f in above if f.reach >= scale.reach]
            above = [*shared, scale, *above[len(shared) :]]
        value = self._quotient(above, below, coefficient)
        return self.new.apply("neg", value) if negative else value

    def _divisor(self, product: Product) -> Powers:
        """What does vary below the line, where it is divided by: a reciprocal root is multiplied."""
        return tuple(p for p in product.powers if p[1] < 0 and self.atoms[p[0]].varies and p[0] not in self.rooted)

    def _scale(self, coefficient: float, fixed: Powers) -> _Factor | None:
        """The coefficient and what does not vary, which kernels compute once; None for 1 alone."""
        if not fixed:
            if coefficient == 1.0:
                return None
            return _Factor(self.new.constant(coefficient), self.outputs, 1)
        above, below = self._factors(fixed, 1), self._factors(fixed, -1)
        if coefficient != 1.0 or not above:
            above = [_Factor(self.new.constant(coefficient), 0, 1), *above]
        return _Factor(self._quotient(above, below), min(self.reach[k] for k, _ in fixed), 1)

    def _factors(self, powers: Powers, sign: int) -> list[_Factor]:
        """The powers above the line, sign = 1, or below it; what most outputs share comes first."""
        factors = []
        for k, exponent in powers:
            rooted = exponent < 0 and k in self.rooted  # its reciprocal is multiplied
            if (exponent > 0 or rooted) != (sign > 0):
                continue
            node, count, reach = self.written[k], abs(exponent) // 2, self.reach[k]
            if rooted:
                root = self.new.apply("div", self.new.constant(1.0), self.new.apply("sqrt", node))
                factors.append(_Factor(self._raised(root, -exponent), reach, 1))
                continue
            if exponent % 2:
                factors.append(_Factor(self.new.apply("sqrt", node), reach, 1))
            if count:
                factors.append(_Factor(self._raised(node, count), reach, count))
        return sorted(factors, key=lambda f: -f.reach) if len(factors) > 1 else factors

    def _raised(self, node: int, count: int) -> int:
        if count == 1:
            return node
        half = self._raised(node, count // 2)
        square = self.new.apply("mul", half, half)
        return self.new.apply("mul", square, node) if count % 2 else square

    def _quotient(self, above: Sequence[_Factor], below: Sequence[_Factor], empty: float = 1.0) -> int:
        """The product of factors over that of others, in steps where these are many; `empty`: what stands above for no
        factors."""
        tops, bottoms = self._steps(above), self._steps(below)
        value = tops[0] if tops else self.new.constant(empty)
        for i in range(max(len(tops), len(bottoms))):
            if 0 < i < len(tops):
                value = self.new.apply("mul", value, tops[i])
            if i < len(bottoms):
                value = self.new.apply("div", value, bottoms[i])
        return value

    def _steps(self, factors: Sequence[_Factor]) -> list[int]:
        """Products of as many factors as may be multiplied together, each of factors that as many outputs share."""
        if sum(f.weight for f in factors) <= self.together:
            return [self._multiplied(factors)] if factors else []
        steps: list[list[_Factor]] = []
        for factor in factors:
            step = steps[-1] if steps else []
            full = sum(f.weight for f in step) + factor.weight > self.together
            if not step or full or factor.reach != step[-1].reach:
                steps.append([factor])
            else:
                step.append(factor)
        return [self._multiplied(step) for step in steps]

    def _multiplied(self, factors: Sequence[_Factor]) -> int:
        node = factors[0].node
        for factor in factors[1:]:
            node = self.new.apply("mul", node, factor.node)
        return node


Fact = Callable[[_Rewriting, Sequence[Product]], Facts]
_POSITIVE: dict[str, Fact] = {
    "anywhere": lambda by, products: (NONE, None),
    "at 0": lambda by, products: (NONE, by._nonzero(products[0])),
    "nowhere": lambda by, products: (NONE, NONE),
}
_FACTS: dict[str, Fact] = {
    "value": lambda by, products: (by._positive(products[0]), by._nonzero(products[0])),
    "sum": _Rewriting._of_sum,
    "minimum": _Rewriting._of_minimum,
    "maximum": _Rewriting._of_maximum,
    "select": _Rewriting._of_choice,
    **{name: _POSITIVE[row.zero] for name, row in OPERATIONS.items() if row.positive},
}
"""Facts about the results of operations: the conditions for these to be positive, and not to be 0."""


def _all(needed: Iterable[Nodes]) -> Nodes:
    """What all of some facts need; None where one is not known."""
    total = NONE
    for nodes in needed:
        if nodes is None:
            return None
        total |= nodes
    return total


def _any(needed: Iterable[Nodes]) -> Nodes:
    """What the fact that needs least needs; None where none is known."""
    return min((nodes for nodes in needed if nodes is not None), key=len, default=None)


def _times(a: Product, b: Product) -> Product:
    coefficient, first, second = a.coefficient * b.coefficient, a.powers, b.powers
    if not first or not second:
        return Product(coefficient, first or second)
    if first[-1][0] < second[0][0]:
        return Product(coefficient, first + second)
    if second[-1][0] < first[0][0]:
        return Product(coefficient, second + first)
    powers = dict(first)
    for k, e in second:
        powers[k] = powers.get(k, 0) + e
    return Product(coefficient, tuple(sorted((k, e) for k, e in powers.items() if e)))


def _inverse(a: Product) -> Product:
    return Product(1.0 / a.coefficient, tuple((k, -e) for k, e in a.powers))


def _opposite(a: Product) -> Product:
    return Product(-a.coefficient, a.powers)


def _ordinary(coefficient: float) -> bool:
    """Whether a coefficient is a normal number in any dtype, so that no product of constants vanishes."""
    return 1e-30 < abs(coefficient) < 1e30
