"""Compiled kernels of a study, which the display of their compilation counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Literal

from wearsim.mechanics.numerics.jit import compilation_reported, ready_kernels
from wearsim.scenario import Scenario

#: Kernels of the built-in contact models and tangential theories, with the kernels that they call.
_MODELS: dict[str, set[str]] = {
    "slender": {"solve_slender", "factor_in_place", "solve_factored"},
    "hertz": {"hertz_on_profile"},
    "hertz-fastsim": {
        "solve_contacts",
        "find_patches",
        "hertz_on_profile",
        "fit_within",
        "prescribed_ellipse",
    },
    "semi-hertzian": {"solve_semi_hertzian"},
}
_THEORIES: dict[str, set[str]] = {
    "strip": set(),
    "fastsim": {"closed_form"},
    "fastrip": {"fastrip", "beyond_strip_theory"},
}
_FIELDS: dict[str, set[str]] = {
    "strip": set(),
    "fastsim": {"march_fields"},
    "fastrip": {"march_fields", "fastrip_fields"},
}


def kernels_of(
    scenario: Scenario,
    study: Literal["test", "contacts", "contact"] = "test",
    fields: bool = False,
) -> set[str]:
    """Return the names of the kernels that a study calls, including those called by kernels.

    Kernels of plugins are not included.

    Parameters
    ----------
    scenario : Scenario
    study : {"test", "contacts", "contact"}
        Wear tests, the same contact for many realisations, or a single contact.
    fields : bool
        Whether the study computes the fields of a contact.
    """
    steps = study == "test"
    contact, evolution = scenario.contact, scenario.evolution
    model, name = contact.model, evolution.stepper
    theory = getattr(contact.options, "tangential", "strip")
    by_strips, batched = model in _MODELS and model != "hertz-fastsim", model == "slender"
    strip_theory = by_strips and theory == "strip"
    roles = {item.role for item in scenario.random}
    constant = scenario.load.built.constant
    varies = "process" in roles or not constant
    redrawn = any(item.is_redrawn for item in scenario.random)
    # the test on coarse strips
    coarse = evolution.strip_error and not (name == "per-pass" and redrawn)
    compliant, implicit = model in {"slender", "semi-hertzian"}, name in {"auto", "implicit"}
    linearised = steps and compliant and (implicit or coarse)
    by_doubling = varies or theory == "fastsim"
    by_differences = theory != "fastsim" and (not varies or (coarse and constant))
    doubled = name != "per-pass" if not (compliant and implicit) else evolution.step is not None
    called: list[tuple[bool, Iterable[str]]] = [
        (model in _MODELS, _MODELS.get(model, ())),
        (model == "hertz-fastsim" and fields, {"march_fields"}),
        (by_strips, _THEORIES.get(theory, ())),
        (by_strips and fields, _FIELDS.get(theory, ())),
        (strip_theory and batched, {"strip_contacts"}),
        (strip_theory and (fields or not batched), {"solve_strips"}),
        (strip_theory and batched and steps and name == "per-pass", {"run_passes"}),
        (linearised, {"begin_step", "linearise_step", "compare_step", "end_step", "next_steps"}),
        (linearised, {"parts_of_aim"}),
        (linearised and by_doubling, {"difference_sizes"}),
        (linearised and by_differences, {"assess_step"}),
        (linearised and (by_differences or not varies), {"energy_steps"}),
        (steps and scenario.fatigue is not None, {"damage_of_step"}),
        (steps and (doubled or (coarse and not compliant)), {"difference_sizes"}),
        ("field" in roles, {"smooth", "half_lengths"}),
    ]
    return {kernel for is_called, kernels in called if is_called for kernel in kernels}


@contextmanager
def compilation_counted(
    report: Callable[[int, int], None], needed: Callable[[], Iterable[str]]
) -> Iterator[None]:
    """Report the number of every kernel that is compiled in the context, and their total.

    Kernels that are read from the cache count as compiled.

    Parameters
    ----------
    report : callable
        Called with number and total when the compilation of a kernel starts.
    needed : callable
        Returns the names of the kernels of the study; called at the first compilation only.
    """
    names, started = set[str](), set[str]()

    def count(name: str) -> None:
        if not names:
            names.update(needed())
        started.add(name)
        names.add(name)
        report(len(names & (started | ready_kernels())), len(names))

    with compilation_reported(count):
        yield
