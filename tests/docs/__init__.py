"""The code blocks and commands of the documents, run.

Every fence of every page has a language. The blocks of a page run in order, in one new folder and one namespace:

``sh``
    Commands, one a line, without prompt; ``cosim``, ``python -m`` of our packages and scripts run within the tests,
    some tools for files as they are. Of pip and make, extras and targets must exist. All else needs a ``not run``.
``python``
    Run. A literal in the comment behind an expression, or an assignment to one name, is its result: compared, numbers
    to the digits shown, ``...`` for anything. ``f(x)  # 0.84`` and ``f(x)  # in the open: 0.84`` both show one.
``text``
    What the block before printed, compared; ``...`` stands for what varies. With a setup of its own, what that printed.
``toml``, ``json``, ``c``
    Loaded by our loaders, parsed, compiled.

Comments above a fence say what else there is to know, and why no test runs a block: see `tests.docs.directives`. Known
ports are replaced by free ones. A page with a block marked slow runs with --slow alone; its commands are parsed in
every run.
"""
