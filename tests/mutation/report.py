"""Results as a table of mutants and a score for each package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tests.mutation.mutants import Mutant
from tests.mutation.running import Result


def report(mutants: Sequence[Mutant], listed: Mapping[str, str], results: Mapping[str, Result]) -> str:
    """Return the table, a line for each mutant, and the scores.

    Parameters
    ----------
    mutants : sequence of Mutant
        In the order in which they are shown.
    listed : mapping from str to str
        Reasons of those that change nothing, by key.
    results : mapping from str to Result
        Of all others, by key.

    Returns
    -------
    str
        Text of several lines.
    """
    lines, counts = [], dict[str, list[int]]()
    for mutant in mutants:
        kill, live, same = counts.setdefault(mutant.path.partition("/")[0], [0, 0, 0])
        if mutant.key in listed:
            said, same = "changes nothing", same + 1
        else:
            result = results[mutant.key]
            if result.doubtful:
                said, live = f"IN DOUBT: fails in any case: {result.by}", live + 1
            elif result.survived:
                said, live = "SURVIVED", live + 1
            else:
                said, kill = f"{result.how} {result.by.removeprefix('tests/')}", kill + 1
        counts[mutant.path.partition("/")[0]] = [kill, live, same]
        lines.append(f"{mutant.path}:{mutant.line}  {mutant.before} → {mutant.after}  {mutant.text[:70]}\n    {said}")
    for package, (kill, live, same) in counts.items():
        lines.append(
            f"{package}: {kill} of {kill + live} noticed, {kill / max(1, kill + live):.1%}; {same} change nothing"
        )
    seconds = sum(results[mutant.key].seconds for mutant in mutants if mutant.key in results)
    kill, live, same = (sum(count[i] for count in counts.values()) for i in range(3))
    lines.append(f"all: {kill} of {kill + live} noticed; {same} change nothing; {seconds:.0f} s of processor time")
    return "\n".join(lines)
