"""Schema of the results file of a dissipation study: format, axes and variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from wearsim.results.schema import Axis, Schema, Variable, by_name, with_random_inputs

_DRAW = ("realisation",)
_STRIPS = ("y",)
_PER_LENGTH = "dissipated power per axial length"

VARIABLES: Mapping[str, Variable] = by_name(
    (
        Variable("y", _STRIPS, "m", "axial position", "static"),
        Variable("power", _DRAW, "W", "dissipated power of the contact", "record"),
        Variable("force_x", _DRAW, "N", "longitudinal force on the cylinder", "record"),
        Variable("force_y", _DRAW, "N", "lateral force on the cylinder", "record"),
        Variable("spin_moment", _DRAW, "N m", "spin moment on the cylinder", "record"),
        Variable("normal_force", _DRAW, "N", "normal force of a roller", "record"),
        Variable("longitudinal_creepage", _DRAW, "1", "mean longitudinal creepage", "record"),
        Variable("peak_pressure", _DRAW, "Pa", "greatest normal pressure", "record"),
        Variable(
            "adhesion_fraction", _DRAW, "1", "part of the contact area that adheres", "record"
        ),
        Variable("dissipation", ("kept", "y"), "W/m", _PER_LENGTH, "record"),
        *(
            Variable(
                f"dissipation_{ending}", _STRIPS, "W/m", f"{words}: {_PER_LENGTH}", "statistic"
            )
            for ending, words in (
                ("mean", "mean over all realisations"),
                ("std", "standard deviation over all realisations"),
                ("low", "2.5 % quantile over kept realisations"),
                ("high", "97.5 % quantile over kept realisations"),
            )
        ),
        Variable(
            "mean_problem_dissipation",
            _STRIPS,
            "W/m",
            f"{_PER_LENGTH}, every random input at its mean",
            "static",
        ),
    )
)

DISSIPATION = Schema(
    "wearsim-dissipation",
    2,
    "realisations of one contact, from `wearsim dissipation`",
    by_name(
        (
            Axis("realisation", "realisation of the random inputs", 0),
            Axis("kept", "realisation whose dissipation per strip is stored", 0),
        )
    ),
    VARIABLES,
)
"""Schema without the random inputs, which differ between studies."""


def dissipation_schema(inputs: Sequence[Mapping[str, str]]) -> Schema:
    """Return the schema of a study, with its drawn values; see `with_random_inputs`."""
    return with_random_inputs(DISSIPATION, inputs)
