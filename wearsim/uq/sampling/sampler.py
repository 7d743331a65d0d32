"""The sampler of a study: which uniform numbers each input takes in each realisation."""

from __future__ import annotations

from collections.abc import Sequence

from wearsim.types import FloatArray
from wearsim.uq.sampling.gaussian_copula import Correlation, GaussianCopula
from wearsim.uq.sampling.plans import PlanName, drawing
from wearsim.uq.sampling.sobol import slots


class Sampler:
    """Draws all inputs of a study by a plan.

    A realisation has its numbers for ever: neither the order nor the batches in which it is asked
    for change a bit of them, and nor do inputs that are added, left out or named in another order.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    inputs : sequence of (str, int)
        Name of each input and how many uniform numbers a draw of it takes.
    plan : {"monte-carlo", "latin-hypercube", "sobol"}
        How the realisations are spread.
    total : int, optional
        Realisations of the whole plan; needed by "latin-hypercube".
    correlations : sequence of (str, str, float)
        Rank correlations between inputs of one number each. They come after the plan: what is
        tied to another input keeps its law, and is no longer as evenly spread.
    replicates : int
        Independent sequences that "sobol" takes in turn: realisation k is number k // replicates
        of sequence k % replicates.

    Raises
    ------
    ValueError
        If an input, the plan or the correlations cannot be used.
    """

    def __init__(
        self,
        seed: int,
        inputs: Sequence[tuple[str, int]],
        plan: PlanName = "monte-carlo",
        total: int | None = None,
        correlations: Sequence[Correlation] = (),
        replicates: int = 1,
    ) -> None:
        self._dimensions = _dimensions(inputs)
        self._draw = drawing(plan, seed, total, replicates)
        self._copula = GaussianCopula(correlations, self._dimensions)
        if plan == "sobol":
            _refuse_shared_slots(self._dimensions)

    def uniforms(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the uniform numbers of `count` realisations on end.

        Parameters
        ----------
        first, count : int
            The first realisation, counted from 0, and how many.

        Returns
        -------
        dict of str to ndarray, shape (count, dimension)
            By input; strictly between 0 and 1.

        Raises
        ------
        ValueError
            If the plan does not have these realisations.
        """
        if first < 0 or count < 0:
            raise ValueError(
                f"realisations are counted from 0, got {count} of them from {first} on"
            )
        return self._copula.correlate(
            {
                name: self._draw(name, dimension, first, count)
                for name, dimension in self._dimensions.items()
            }
        )


def _dimensions(inputs: Sequence[tuple[str, int]]) -> dict[str, int]:
    """Return the dimensions by name, having refused what cannot be drawn."""
    dimensions: dict[str, int] = {}
    for name, dimension in inputs:
        if name in dimensions:
            raise ValueError(f"the input {name} stands twice; give each its own name")
        if dimension < 1:
            raise ValueError(f"the input {name} must take 1 or more numbers, got {dimension}")
        dimensions[name] = dimension
    return dimensions


def _refuse_shared_slots(dimensions: dict[str, int]) -> None:
    """Refuse inputs that would get the same dimension of the Sobol sequence."""
    owner: dict[int, str] = {}
    for name, dimension in dimensions.items():
        for slot in slots(name, dimension) or ():
            if slot in owner:
                raise ValueError(
                    f"{owner[slot]} and {name} are one quantity, and have one dimension of the"
                    " Sobol sequence between them; draw only one of them"
                )
            owner[slot] = name
