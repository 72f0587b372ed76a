"""Systems for the tests of the formats: the tipping problem, and random ones."""

import tomllib
from dataclasses import replace
from pathlib import Path

from hypothesis import strategies as st

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.propositions import And, Is, Not, Or
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.values import Constant, Formula, Linear

# files in the manner of other tools, by name
FOREIGN = {path.name: path.read_text() for path in (Path(__file__).parents[2] / "data" / "fuzzy" / "foreign").iterdir()}

FAULTS, REFUSED = (tomllib.loads(FOREIGN[f"{name}.toml"]) for name in ("faults", "refused"))


def _grades(*names):
    return dict(zip(names, (triangle(0, 0, 5), triangle(0, 5, 10), triangle(5, 10, 10)), strict=True))


# the tipping problem of scikit-fuzzy's and MATLAB's manuals; at quality 6.5 and service 9.8 the tip is 12118694/610275
TIPPING = System(
    tuple(Variable(name, (0, 10), _grades("poor", "average", "good")) for name in ("quality", "service")),
    (Output("tip", (0, 25), {"low": triangle(0, 0, 13), "medium": triangle(0, 13, 25), "high": triangle(13, 25, 25)}),),
    (
        "if quality is poor or service is poor then tip is low",
        "if service is average then tip is medium",
        "if quality is good or service is good then tip is high",
    ),
    name="tipping",
    normalization="none",
)

# what only richer systems have, without what one of the formats cannot express
_FIRST, _SECOND = TIPPING.inputs
_MORE = Term("near", curve("gaussian", 5, 2)), Term("far", curve("bell", 5, 2, 3))
_ALSO = Term("slow", curve("sigmoid", 4, -2)), Term("at", curve("singleton", 3))
RICH = replace(
    TIPPING,
    inputs=(
        replace(_FIRST, terms=(*_FIRST.terms, *_MORE)),
        replace(_SECOND, terms=(*_SECOND.terms, *_ALSO)),
    ),
    outputs=(Output("tip", (0, 25), {"low": Constant(5), "high": Linear((1, 0.5), 2)}, None, "average", "sum"),),
    rules=(
        "if quality is poor or service is poor then tip is low",
        "if quality is near and service is not slow then tip is high with 0.5",
        "if quality is far then tip is low",
        "if service is at then tip is high",
    ),
    conjunction="einstein_product",
)  # fmt: skip
# and what a format can say beyond, by format
RICHER = {
    "fcl": replace(RICH, rules=(*RICH.rules, Rule(Is("quality", "poor"), (Is("tip", "low"),), 1.0, Operators("prod")))),
    "fis": replace(
        RICH,
        inputs=(
            RICH.inputs[0],
            replace(_SECOND, terms=(*RICH.inputs[1].terms, Term("s", curve("pi_shape", 1, 2, 3, 4)))),
        ),
        rules=(*RICH.rules, "if service is s then tip is high"),
    ),
}  # fmt: skip
RICHER["fll"] = replace(
    RICHER["fcl"],
    outputs=(
        replace(
            RICH.outputs[0], default=1.5, lock_range=True, lock_previous=True,
            terms=(*RICH.outputs[0].terms, Term("odd", Formula("sin(quality) / service + 2 ^ quality"))),
        ),
        Output(
            "mood", (0, 1), (Term("fair", curve("spike", 0.5, 1)), Term("good", curve("s_shape", 0, 1))), None,
            "bisector", "probor",
        ),
    ),
    rules=(
        *RICHER["fcl"].rules, "if quality is very near and service is any then mood is good and tip is odd",
        "if quality is extremely not near then mood is fair", "if mood is good then tip is low",
    ),
)  # fmt: skip
RICHER["json"] = RICHER["toml"] = RICHER["fll"]

WORDS = ("low", "high", "a", "B2", "wind_speed", "x__y", "Zz", "mid")
NAMES = (
    *WORDS, "not exist", "max", "_x", "very", "Low", "sin", "à la", "it's", "a=b", "a#b", "%", "é", "1st", "is", "日",
)  # fmt: skip
places = st.one_of(
    st.integers(-4, 12).map(float),
    st.floats(-10, 15, allow_subnormal=False),
    st.floats(-1e300, 1e300),
)


@st.composite
def shapes(draw, plain):
    if plain:
        kind, n = draw(st.sampled_from(((triangle, 3), (trapezoid, 4), (rising, 2), (falling, 2))))
        return kind(*sorted(draw(st.lists(places, min_size=n, max_size=n, unique=True))))
    degrees = st.sampled_from((0.0, 1.0, 0.5, 0.3)) | st.floats(0, 1)
    xs = sorted(draw(st.lists(places, min_size=1, max_size=5, unique=True)))
    xs = [x for x in xs for _ in range(draw(st.sampled_from((1, 1, 1, 2))))]
    return Shape(tuple((x, draw(degrees)) for x in xs))


@st.composite
def variables(draw, name, names, plain, output=False):
    low, high = sorted(draw(st.lists(places, min_size=2, max_size=2, unique=True)))
    width = 1e100 if output else 1e301
    if not 1 / width < high - low < width:
        low, high = 0.0, 10.0
    terms = []
    for term in draw(st.lists(names, min_size=1, max_size=3, unique_by=str.lower)):
        shape = draw(shapes(plain))
        if output and not shape.within((low, high)).area((low, high)) > 0:
            shape = triangle(low, low / 2 + high / 2, high)
        terms.append(Term(term, shape))
    if not output:
        return Variable(name, (low, high), tuple(terms))
    default = None if plain else draw(st.none() | st.sampled_from((low, high)) | st.floats(low, high))
    return Output(name, (low, high), tuple(terms), default)


@st.composite
def conditions(draw, inputs, plain):
    def statement(v):
        found = Is(v.name, draw(st.sampled_from(v.term_names)))
        return Not(found) if draw(st.booleans()) else found

    if plain:
        chosen = [v for v in inputs if draw(st.booleans())] or [inputs[0]]
        parts = tuple(statement(v) for v in chosen)
        return parts[0] if len(parts) == 1 else draw(st.sampled_from((And, Or)))(parts)
    leaf = st.sampled_from(inputs).map(statement)
    return draw(
        st.recursive(
            leaf,
            lambda inner: (
                st.lists(inner, min_size=2, max_size=3).map(lambda parts: And(tuple(parts)))
                | st.lists(inner, min_size=2, max_size=3).map(lambda parts: Or(tuple(parts)))
                | inner.map(Not)
            ),
            max_leaves=5,
        )
    )


@st.composite
def systems(draw, plain=False):
    """Any system; every format supports plain ones."""
    names = st.sampled_from(WORDS if plain or draw(st.integers(0, 3)) else NAMES)
    found = draw(st.lists(names, min_size=2, max_size=4, unique_by=str.lower))
    cut = draw(st.integers(1, len(found) - 1))
    inputs = tuple(draw(variables(name, names, plain)) for name in found[:cut])
    outputs = tuple(draw(variables(name, names, plain, output=True)) for name in found[cut:])
    rules = []
    for _ in range(draw(st.integers(1, 3))):
        chosen = [o for o in outputs if draw(st.booleans())] or [outputs[0]]
        if not plain and draw(st.booleans()):
            chosen.reverse()
        conclusions = tuple(Is(o.name, draw(st.sampled_from(o.term_names))) for o in chosen)
        weight = draw(st.just(1.0) | st.floats(0, 1, exclude_min=True))
        rules.append(Rule(draw(conditions(inputs, plain)), conclusions, weight))
    weights_of = draw(st.just(()) | st.just(tuple(f"criterion of {o.name}" for o in outputs)))
    conjunction, disjunction = draw(st.sampled_from((("min", "max"), ("prod", "probor"))))
    return System(
        inputs,
        outputs,
        tuple(rules),
        draw(names),
        conjunction,
        disjunction if plain or draw(st.integers(0, 3)) else draw(st.sampled_from(("max", "probor"))),
        draw(st.sampled_from(("min", "prod"))),
        draw(st.sampled_from(("range", "none", "sum", "max"))),
        draw(st.sampled_from(("refuse", "clip"))),
        draw(st.integers(3, 2000)),
        weights_of,
    )
