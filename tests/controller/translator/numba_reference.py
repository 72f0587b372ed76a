"""The Python text of translated functions compiled by Numba, as an independent translation."""

import ast
import dis
import functools
import inspect
import textwrap
import types

import numba
import numpy as np
from numba.extending import overload, typeof_impl

from controller.stack_array import array, zeros
from controller.state import State


@functools.cache
def by_numba(function):
    """Return a function, and all that it calls, compiled by Numba."""
    names = {name: _of_numba(value) for name, value in function.__globals__.items() if name in _used(function.__code__)}
    cells = inspect.getclosurevars(function).nonlocals
    names |= {name: _of_numba(value) for name, value in cells.items()}
    names |= {"__name__": function.__module__, "__builtins__": __builtins__, "abs": np.abs}
    names |= {f.__name__: f for f in (_product, _replaced, _items, _value)}
    text = getattr(function, "source", None) or textwrap.dedent(inspect.getsource(function))
    tree = ast.fix_missing_locations(_InOrder().visit(ast.parse(text)))
    tree.body[0].decorator_list, tree.body[0].returns = [], None
    for argument in tree.body[0].args.args:
        argument.annotation = None
    exec(compile(tree, f"<{function.__qualname__}>", "exec"), names)
    return numba.njit(error_model="numpy")(names[function.__name__])


class _InOrder(ast.NodeTransformer):
    """Puts calls where Numba adds in another order, or knows no such operation."""

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if not isinstance(node.op, ast.MatMult):
            return node
        return ast.Call(ast.Name("_product", ast.Load()), [node.left, node.right], [])

    def visit_Call(self, node):
        self.generic_visit(node)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            made = node.func.value
            for keyword in node.keywords:
                made = ast.Call(ast.Name("_replaced", ast.Load()), [made, ast.Constant(keyword.arg), keyword.value], [])
            return made
        return node

    def visit_Attribute(self, node):
        self.generic_visit(node)
        if node.attr not in _state_fields():
            return node
        if isinstance(node.ctx, ast.Load):
            return ast.Call(ast.Name("_value", ast.Load()), [node], [])
        return ast.Subscript(ast.Attribute(node.value, node.attr, ast.Load()), ast.Constant(...), ast.Store())

    def visit_AugAssign(self, node):
        if not isinstance(node.target, ast.Attribute):
            return self.generic_visit(node)
        old = ast.Attribute(node.target.value, node.target.attr, ast.Load())
        return self.visit(ast.Assign([node.target], ast.BinOp(old, node.op, node.value)))

    def visit_Assign(self, node):
        self.generic_visit(node)
        if isinstance(node.targets[0], ast.Tuple) and not isinstance(node.value, ast.Tuple):
            n = ast.Constant(len(node.targets[0].elts))
            node.value = ast.Call(ast.Name("_items", ast.Load()), [node.value, n], [])
        return node


def _state_fields(of=State):
    """Return the names of the fields of all kinds of states."""
    return set(of._fields).union(*map(_state_fields, of.__subclasses__()))


def _used(code):
    """Return all global names that code refers to."""
    inner = [_used(constant) for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return {step.argval for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL"}.union(*inner)


def _of_numba(value):
    if value in (zeros, array) if isinstance(value, types.FunctionType) else False:
        return value
    if isinstance(value, types.FunctionType) and value.__module__.partition(".")[0] in ("controller", "cosim"):
        return by_numba(value)
    if isinstance(value, types.ModuleType) and value.__name__.startswith("controller."):
        return _Module(value)
    return value


class _Module(types.ModuleType):
    """A module whose functions are compiled by Numba when they are asked for."""

    def __init__(self, module):
        super().__init__(module.__name__)
        self._module = module

    def __getattr__(self, name):
        return _of_numba(getattr(self._module, name))


def _product(a, b):
    raise NotImplementedError


def _replaced(record, name, value):
    raise NotImplementedError


def _items(values, n):
    raise NotImplementedError


@typeof_impl.register(State)
def _type_of_state(state, context):
    return numba.types.NamedTuple([typeof_impl(item, context) for item in state], type(state))


def _value(item):
    raise NotImplementedError


@overload(_value)
def _value_of_field(item):
    if getattr(item, "ndim", None) == 0:
        return lambda item: item[()]
    return lambda item: item


@overload(zeros)
def _zeros(*shape):
    return lambda *shape: np.zeros(shape)


@overload(array)
def _array(*items):
    return lambda *items: np.array(items)


@overload(_product)
def _product_in_order(a, b):
    def vectors(a, b):
        total = 0.0
        for k in range(b.shape[0]):
            total += a[k] * b[k]
        return total

    def matrix_vector(a, b):
        total = np.zeros(a.shape[0])
        for i in range(a.shape[0]):
            for k in range(b.shape[0]):
                total[i] += a[i, k] * b[k]
        return total

    def vector_matrix(a, b):
        total = np.zeros(b.shape[1])
        for j in range(b.shape[1]):
            for k in range(b.shape[0]):
                total[j] += a[k] * b[k, j]
        return total

    def matrices(a, b):
        total = np.zeros((a.shape[0], b.shape[1]))
        for i in range(a.shape[0]):
            for j in range(b.shape[1]):
                for k in range(b.shape[0]):
                    total[i, j] += a[i, k] * b[k, j]
        return total

    return {(1, 1): vectors, (2, 1): matrix_vector, (1, 2): vector_matrix, (2, 2): matrices}[a.ndim, b.ndim]


@overload(_replaced, prefer_literal=True)
def _replaced_field(record, name, value):
    fields = [f"record.{field}" if field != name.literal_value else "value" for field in record.fields]
    names = {"kind": record.instance_class}
    exec(f"def made(record, name, value):\n    return kind({', '.join(fields)})", names)
    return names["made"]


@overload(_items, prefer_literal=True)
def _items_of(values, n):
    if not isinstance(values, numba.types.Array):
        return lambda values, n: values
    names = {}
    items = ", ".join(f"values[{i}]" for i in range(n.literal_value))
    exec(f"def made(values, n):\n    return ({items})", names)
    return names["made"]
