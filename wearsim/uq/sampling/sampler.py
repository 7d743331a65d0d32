"""Sampler of a study: the uniform numbers of all inputs in each realisation."""

from __future__ import annotations

from collections.abc import Sequence

from wearsim.types import FloatArray
from wearsim.uq.sampling.gaussian_copula import Correlation, GaussianCopula
from wearsim.uq.sampling.plans import PlanName, drawing
from wearsim.uq.sampling.sobol import slots


class Sampler:
    """Sampler of all inputs of a study by one sampling design.

    The numbers of a realisation do not depend on the order or batch size in which realisations are
    requested, nor on other inputs and the order of the inputs.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    inputs : sequence of (str, int)
        Name of each input and number of uniform numbers per draw.
    plan : {"monte-carlo", "latin-hypercube", "sobol"}
        Sampling design.
    total : int, optional
        Number of realisations of the design; needed by "latin-hypercube".
    correlations : sequence of (str, str, float)
        Rank correlations between inputs of one number each. They are applied to the numbers of the
        design: a correlated input keeps its distribution, but is less evenly spread.
    replicates : int
        Number of independent, alternating sequences of "sobol": realisation k is the point
        k // replicates of the sequence k % replicates.

    Raises
    ------
    ValueError
        If an input, the design or the correlations are invalid.
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
        self._dimensions: dict[str, int] = {}
        for name, dimension in inputs:
            if name in self._dimensions:
                raise ValueError(f"the input {name} is given twice; use different names")
            if dimension < 1:
                raise ValueError(f"the input {name} must take 1 or more numbers, got {dimension}")
            self._dimensions[name] = dimension
        self._draw = drawing(plan, seed, total, replicates)
        self._copula = GaussianCopula(correlations, self._dimensions)
        owner: dict[int, str] = {}
        for name, dimension in self._dimensions.items() if plan == "sobol" else ():
            for slot in slots(name, dimension) or ():
                if slot in owner:
                    raise ValueError(
                        f"{owner[slot]} and {name} are one quantity and share a dimension of the"
                        " Sobol sequence; draw only one of them"
                    )
                owner[slot] = name

    def uniforms(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the uniform numbers of `count` consecutive realisations.

        Parameters
        ----------
        first, count : int
            First realisation, counted from 0, and number of realisations.

        Returns
        -------
        dict of str to ndarray, shape (count, dimension)
            Numbers of each input, strictly between 0 and 1.

        Raises
        ------
        ValueError
            If the design does not have these realisations.
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
