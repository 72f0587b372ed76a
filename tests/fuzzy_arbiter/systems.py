"""Random systems for the tests."""

from hypothesis import strategies as st

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, rising
from fuzzy_arbiter.propositions import And, Is, Not, Or

grid = st.integers(0, 16).map(lambda i: i / 16.0)


@st.composite
def shapes(draw, jumps=True):
    """A shape with an area in [0, 1]."""
    places = sorted(draw(st.lists(grid, min_size=1, max_size=5, unique=True)))
    points = []
    for x in places:
        points.append((x, draw(grid)))
        if jumps and draw(st.integers(0, 4)) == 0:
            points.append((x, draw(grid)))
    shape = Shape(tuple(points))
    return shape if shape.area((0.0, 1.0)) > 0.0 else Shape(((0.0, 0.25), (1.0, 1.0)))


def variables(kind, prefix, jumps=True):
    """One to three variables on [0, 1] with one to three terms each."""

    @st.composite
    def build(draw):
        result = []
        for i in range(draw(st.integers(1, 3))):
            terms = tuple(Term(f"t{j}", draw(shapes(jumps))) for j in range(draw(st.integers(1, 3))))
            result.append(kind(f"{prefix}{i}", (0.0, 1.0), terms))
        return tuple(result)

    return build()


LOW_HIGH = tuple(Output(name, (0, 1), {"low": falling(0, 1), "high": rising(0, 1)}) for name in "yz")


@st.composite
def systems(draw, jumps=True, norms=True, outputs=None):
    """A system with normalization none and random rules."""
    inputs = draw(variables(Variable, "x", jumps))
    outputs = outputs[: draw(st.integers(1, len(outputs)))] if outputs else draw(variables(Output, "y", jumps))
    statements = st.sampled_from([Is(v.name, t) for v in inputs for t in v.term_names])
    conditions = st.recursive(
        statements,
        lambda inner: st.one_of(
            inner.map(Not),
            st.lists(inner, min_size=2, max_size=3).map(lambda parts: And(tuple(parts))),
            st.lists(inner, min_size=2, max_size=3).map(lambda parts: Or(tuple(parts))),
        ),
        max_leaves=5,
    )
    rules = []
    for _ in range(draw(st.integers(1, 5))):
        on = draw(st.lists(st.sampled_from(outputs), min_size=1, max_size=2, unique=True))
        conclusions = tuple(output[draw(st.sampled_from(output.term_names))] for output in on)
        weight = draw(st.sampled_from([1.0, 1.0, 0.75, 0.3]))
        rules.append(Rule(draw(conditions), conclusions, weight))
    return System(
        inputs,
        outputs,
        tuple(rules),
        conjunction=draw(st.sampled_from(["min", "prod"])) if norms else "min",
        disjunction=draw(st.sampled_from(["max", "probor"])) if norms else "max",
        implication=draw(st.sampled_from(["min", "prod"])) if norms else "min",
        normalization="none",
    )
