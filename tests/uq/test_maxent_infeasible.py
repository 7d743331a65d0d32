"""Moments without a distribution of maximum entropy."""

from __future__ import annotations

import math

import pytest

from wearsim.errors import WearsimError
from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy

INF = math.inf


INFEASIBLE = [
    ((0.0, INF), 307.0, 320.0, None, "std 320 is more than mean - low = 307"),
    ((-INF, 0.0), -5.0, 6.0, None, "std 6 is more than high - mean = 5"),
    ((0.0, 1.0), 0.5, 0.5, None, "std 0.5 is not less than sqrt"),
    ((0.0, 1.0), 0.1, 0.4, None, "(high - mean)) = 0.3"),
    ((0.0, 1.0), 0.5, 0.0, None, "std 0 is not above zero"),
    ((0.0, 1.0), 1.0, 0.1, None, "mean 1 is not inside the support [0, 1]"),
    ((0.0, INF), -1.0, None, None, "mean -1 is not inside the support [0, inf)"),
    (
        (0.0, INF),
        None,
        None,
        None,
        "[0, inf) alone determines no distribution, since it is unbounded",
    ),
    ((-INF, INF), 3.0, None, None, "mean 3 alone determines no distribution on (-inf, inf)"),
    ((0.0, 1.0), None, 0.1, None, "a std alone determines no distribution"),
    ((1.0, 1.0), None, None, None, "the support must increase, got 1 to 1"),
    ((math.nan, 1.0), None, None, None, "the support must increase"),
    ((-1.7e308, 1.7e308), None, None, None, "too wide"),
    ((0.0, 1.0), math.nan, 0.1, None, "must be finite"),
    ((0.0, INF), 7.0, None, 2.0, "mean_log 2 is not less than log(mean) = 1.94591"),
    ((0.0, 9.0), 7.0, None, 1.0, "mean_log needs the support [0, inf), got [0, 9]"),
    ((0.0, INF), 7.0, 1.0, 1.0, "replaces the std"),
    ((0.0, INF), None, None, 1.0, "mean_log 1 needs the mean too"),
    ((0.0, INF), -7.0, None, 1.0, "mean -7 is not inside"),
    (
        (0.0, 1e9),
        1.0,
        1.1,
        None,
        "std 1.1 is more than mean - low = 1, which requires a probability",
    ),
    ((-1e9, 0.0), -1.0, 1.1, None, "std 1.1 is more than high - mean = 1, which requires"),
]


@pytest.mark.parametrize(("support", "mean", "std", "mean_log", "message"), INFEASIBLE)
def test_infeasible_moments_are_refused_with_the_limit(
    support: tuple[float, float],
    mean: float | None,
    std: float | None,
    mean_log: float | None,
    message: str,
) -> None:
    with pytest.raises(Infeasible) as caught:
        maximum_entropy(support, mean, std, mean_log)
    assert message in str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, WearsimError)
    assert caught.value.exit_code == 2
