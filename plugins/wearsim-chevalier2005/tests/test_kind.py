"""The reproduction in every display, as any kind of study."""

from __future__ import annotations

from functools import cache

from wearsim.testing import study_kind_tests
from wearsim_chevalier2005.kind import wearsim_study_kinds
from wearsim_chevalier2005.study import Reproduction, reproduce


@cache
def small() -> Reproduction:
    """Return a reproduction with few realisations."""
    return reproduce(4)


test_reproduction_in_every_display = study_kind_tests(next(iter(wearsim_study_kinds())), small)
