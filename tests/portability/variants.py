"""Variants of the test environment: OpenBLAS kernels, the processor that NumPy sees, Pythons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

# what chooses a variant; none of it is taken over from outside
CHOICES = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")


@dataclass(frozen=True)
class Machine:
    """What a Python on this machine computes with, as `kernels` finds it."""

    kernels: dict[str, str]  # of the OpenBLAS that each package brings along, by package; none where it brings none
    features: frozenset[str]  # of the processor, as NumPy and Linux name them, in lower case
    dispatched: tuple[str, ...]  # those for which NumPy has code of its own, that it takes


@dataclass(frozen=True)
class Variant:
    """One way to run the tests."""

    name: str
    environment: dict[str, str] = field(default_factory=dict)
    needs: tuple[str, ...] = ()  # features of the processor
    kernel: tuple[str, ...] = ()  # names by which OpenBLAS may call the kernel
    python: str = ""  # the version, of an environment of its own

    def reason_to_skip(self, machine: Machine) -> str:
        """Return the reason why this machine cannot run it, or ""."""
        if self.kernel and not machine.kernels:
            return "neither NumPy nor SciPy brings an OpenBLAS along"
        if lacking := [name for name in self.needs if name not in machine.features]:
            return f"the processor lacks {', '.join(lacking)}"
        if self.name == NUMPY and not machine.dispatched:
            return "NumPy has no code for what this processor has beyond the least"
        return ""

    def settings(self, machine: Machine) -> dict[str, str]:
        """Return what to set in the environment."""
        if self.name == NUMPY:  # only names that this NumPy knows: it warns of others
            return {"NPY_DISABLE_CPU_FEATURES": ",".join(machine.dispatched)}
        return self.environment

    def not_taken(self, seen: Machine) -> str:
        """Return the setting of the variant that a process lacks, or ""."""
        for package, kernel in seen.kernels.items():
            if self.kernel and kernel not in self.kernel:
                return f"OpenBLAS of {package} runs its kernels for {kernel}"
        if self.name == NUMPY and seen.dispatched:
            return f"NumPy still takes its code for {', '.join(seen.dispatched)}"
        return ""


NUMPY = "numpy-baseline"
_AVX2 = ("avx2", "fma3")
_AVX512 = ("avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl")

VARIANTS = (
    Variant("haswell", {"OPENBLAS_CORETYPE": "Haswell"}, _AVX2, ("Haswell",)),
    Variant("skylakex", {"OPENBLAS_CORETYPE": "SkylakeX"}, _AVX512, ("SkylakeX",)),
    # kernels that an OpenBLAS is built without are others by another name, and it tells the first name that they have
    Variant("zen", {"OPENBLAS_CORETYPE": "Zen"}, _AVX2, ("Zen", "Haswell")),
    Variant("prescott", {"OPENBLAS_CORETYPE": "Prescott"}, ("sse3",), ("Prescott", "Katmai")),
    Variant(NUMPY),
    *(Variant(f"py{version.replace('.', '')}", python=version) for version in ("3.11", "3.12", "3.13", "3.14")),
)


def chosen(names: str) -> list[Variant]:
    """Return the variants that a list such as ``haswell,py313`` names; all of them for an empty one."""
    known = {variant.name: variant for variant in VARIANTS}
    wanted = [name.strip() for name in names.split(",") if name.strip()] or list(known)
    for name in wanted:
        if name not in known:
            raise ValueError(f"--only {name}: expected one of {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(wanted)]


def by_turns(commit: str, variants: Sequence[Variant]) -> list[Variant]:
    """Return the variants in the order in which a commit tries them: the first that can be run is its turn.

    Hashes of commits are spread evenly, and so is the one that they begin with.
    """
    first = int(commit, 16) % len(variants)
    return [*variants[first:], *variants[:first]]


@dataclass(frozen=True)
class Result:
    """The result of a variant."""

    name: str
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    remark: str = ""  # why it was not run, or what is not good
    run: bool = True
    kernels: tuple[str, ...] = ()  # that OpenBLAS was seen to take

    @property
    def good(self) -> bool:
        """Whether it has passed, or could not be asked."""
        return not self.run or (not self.failed and not self.remark and self.passed > 0)


def table(results: Iterable[Result]) -> str:
    """Return a line for each variant."""
    lines = [f"{'variant':<15} {'passed':>7} {'failed':>7} {'skipped':>7} {'seconds':>8}  kernels"]
    for result in results:
        if result.run:
            counts = f"{result.passed:>7} {result.failed:>7} {result.skipped:>7} {result.seconds:>8.0f}"
            remarks = f"{'/'.join(result.kernels)}  {result.remark}".strip()
            lines.append(f"{result.name:<15} {counts}  {remarks}".rstrip())
        else:
            lines.append(f"{result.name:<15} not run: {result.remark}")
    return "\n".join(lines)
