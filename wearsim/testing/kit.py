"""Test functions for plugin authors, one for each kind of plugin."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar

from wearsim.plugins import (
    AxialPair,
    AxialProfileSpec,
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    RandomInputSpec,
    StudyKind,
    TableSpec,
    WearLawSpec,
)
from wearsim.scenario.parse.fields import WITH_MARGINAL
from wearsim.testing import random_inputs
from wearsim.testing.axial_profiles import AXIAL_PROFILE, PAIR, AxialProfileFixture
from wearsim.testing.checks import Check, Checks, ConfiguredSpec, resolve, spec_checks
from wearsim.testing.contact_behaviour import BEHAVIOUR
from wearsim.testing.contact_capabilities import CAPABILITIES
from wearsim.testing.contact_fixtures import ContactCase, ContactFixture
from wearsim.testing.fatigue_laws import FATIGUE_LAW, FatigueLawFixture
from wearsim.testing.motion_laws import MOTION_LAW, MotionLawFixture
from wearsim.testing.random_inputs import RandomInputFixture
from wearsim.testing.study_kinds import STUDY_KIND, StudyKindFixture
from wearsim.testing.tables import TABLE, TableFixture
from wearsim.testing.wear_and_loads import LOADS, WEAR_LAW, LoadFixture, WearLawFixture
from wearsim.units import Kind

F = TypeVar("F")
Tests = Callable[[Check[F]], None]
CONTACT_MODEL = Checks(spec_checks() | BEHAVIOUR | CAPABILITIES)
NOTHING: Mapping[str, str] = {}


def build_tests(checks: Checks[F], build: Callable[[], F], without: Mapping[str, str]) -> Tests[F]:
    """Return a parametrised pytest function with one item per check.

    Parameters
    ----------
    checks : Checks
        The checks.
    build : callable
        Returns the fixture; called by the first check, so that collection costs nothing.
    without : mapping of str to str
        Names of checks to skip, with the reason.

    Raises
    ------
    ValueError
        If a skipped check does not exist.
    """
    import pytest  # noqa: PLC0415  (a dependency of the author's tests, not of wearsim)

    if unknown := [name for name in without if name not in checks]:
        raise ValueError(f"no check is named '{unknown[0]}'; there are: {', '.join(checks)}")
    fixture = cache(build)

    @pytest.mark.parametrize(
        "check",
        [
            pytest.param(
                check,
                id=check.name,
                marks=[pytest.mark.skip(reason=without[check.name])]
                if check.name in without
                else [],
            )
            for check in checks.values()
        ],
    )
    def test(check: Check[F]) -> None:
        __tracebackhide__ = True
        check(fixture())

    return test


def contact_model_tests(
    spec: ContactModelSpec | str,
    options: Mapping[str, object] = NOTHING,
    case: ContactCase | None = None,
    without: Mapping[str, str] = NOTHING,
) -> Tests[ContactFixture]:
    """Return tests of a contact model, one item per requirement.

    Parameters
    ----------
    spec : ContactModelSpec or str
        The spec that the hook yields, or the name of an installed one.
    options : mapping of str to object
        Its options as written in a scenario, quantities with their units.
    case : ContactCase, optional
        The base contact; by default of the test rig.
    without : mapping of str to str
        Names of checks to skip, with the reason.

    Returns
    -------
    callable
        A parametrised test; bind it to a name that begins with ``test``.
    """
    return build_tests(
        CONTACT_MODEL,
        lambda: ContactFixture(
            ConfiguredSpec(resolve(ContactModelSpec, spec), options), case or ContactCase()
        ),
        without,
    )


def random_input_tests(
    spec: RandomInputSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    kind: Kind | None = None,
    files: Mapping[str, str] = NOTHING,
    marginal: tuple[RandomInputSpec | str, Mapping[str, object]] | None = None,
    without: Mapping[str, str] = NOTHING,
) -> Tests[RandomInputFixture]:
    """Return tests of a random input, one item per requirement on its role.

    Parameters
    ----------
    spec : RandomInputSpec or str
        The spec that the hook yields, or the name of an installed one.
    options : mapping of str to object
        Its options as written in a scenario.
    kind : Kind, optional
        Kind of quantity of the values, needed for options with units; None for plain numbers.
    files : mapping of str to str
        Content of the files that the options name.
    marginal : tuple of spec and options, optional
        Distribution of one value of a field or a process, for which it is needed.
    without : mapping of str to str
        See `contact_model_tests`.

    Returns
    -------
    callable
        See `contact_model_tests`.

    Raises
    ------
    TypeError
        If a field or a process has no `marginal`.
    """
    resolved = resolve(RandomInputSpec, spec)
    if marginal is None and resolved.role in WITH_MARGINAL:
        raise TypeError(
            f"random input '{resolved.name}' is a {resolved.role}: give the distribution of one"
            ' value as marginal=("uniform", {"low": 0.08, "high": 0.12})'
        )

    def configured(
        spec: RandomInputSpec | str, options: Mapping[str, object]
    ) -> ConfiguredSpec[RandomInputSpec]:
        return ConfiguredSpec(resolve(RandomInputSpec, spec), options, kind, files)

    return build_tests(
        random_inputs.BY_ROLE[resolved.role],
        lambda: RandomInputFixture(
            configured(resolved, options), configured(*marginal) if marginal else None
        ),
        without,
    )


def wear_law_tests(
    spec: WearLawSpec | str,
    options: Mapping[str, object] = NOTHING,
    without: Mapping[str, str] = NOTHING,
) -> Tests[WearLawFixture]:
    """Return tests of a wear law, one item per requirement; see `contact_model_tests`."""
    return build_tests(
        WEAR_LAW,
        lambda: WearLawFixture(ConfiguredSpec(resolve(WearLawSpec, spec), options)),
        without,
    )


def fatigue_law_tests(
    spec: FatigueLawSpec | str,
    options: Mapping[str, object] = NOTHING,
    without: Mapping[str, str] = NOTHING,
) -> Tests[FatigueLawFixture]:
    """Return tests of a fatigue law, one item per requirement; see `contact_model_tests`."""
    return build_tests(
        FATIGUE_LAW,
        lambda: FatigueLawFixture(ConfiguredSpec(resolve(FatigueLawSpec, spec), options)),
        without,
    )


def load_tests(
    spec: LoadSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    files: Mapping[str, str] = NOTHING,
    duration: float = 3600.0,
    without: Mapping[str, str] = NOTHING,
) -> Tests[LoadFixture]:
    """Return tests of a load or a load term, one item per requirement on its role.

    Parameters
    ----------
    spec, options, without
        See `contact_model_tests`.
    files : mapping of str to str
        Content of the files that the options name.
    duration : float
        Time interval for a load without a span and for a load term [s].

    Returns
    -------
    callable
        See `contact_model_tests`.
    """
    resolved = resolve(LoadSpec, spec)
    return build_tests(
        LOADS[resolved.role],
        lambda: LoadFixture(ConfiguredSpec(resolved, options, files=files), duration),
        without,
    )


def motion_law_tests(
    spec: MotionLawSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    files: Mapping[str, str] = NOTHING,
    angle: float = 1.5,
    rise: float = 8e-3,
    without: Mapping[str, str] = NOTHING,
) -> Tests[MotionLawFixture]:
    """Return tests of a motion law, one item per requirement.

    Parameters
    ----------
    spec, options, without
        See `contact_model_tests`.
    files : mapping of str to str
        Content of the files that the options name.
    angle, rise : float
        Of the segment [rad], [m].

    Returns
    -------
    callable
        See `contact_model_tests`.
    """
    resolved = resolve(MotionLawSpec, spec)
    return build_tests(
        MOTION_LAW,
        lambda: MotionLawFixture(ConfiguredSpec(resolved, options, files=files), angle, rise),
        without,
    )


def axial_profile_tests(
    spec: AxialProfileSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    files: Mapping[str, str] = NOTHING,
    pair: AxialPair = PAIR,
    without: Mapping[str, str] = NOTHING,
) -> Tests[AxialProfileFixture]:
    """Return tests of an axial profile, one item per requirement.

    Parameters
    ----------
    spec, options, without
        See `contact_model_tests`.
    files : mapping of str to str
        Content of the files that the options name.
    pair : AxialPair
        The bodies, by default of steel, with a roller 10 mm wide.

    Returns
    -------
    callable
        See `contact_model_tests`.
    """
    resolved = resolve(AxialProfileSpec, spec)
    return build_tests(
        AXIAL_PROFILE,
        lambda: AxialProfileFixture(ConfiguredSpec(resolved, options, files=files), pair),
        without,
    )


def table_tests(
    spec: TableSpec | str,
    options: Mapping[str, object] = NOTHING,
    without: Mapping[str, str] = NOTHING,
) -> Tests[TableFixture]:
    """Return tests of an installed table of the scenario; see `contact_model_tests`."""
    return build_tests(
        TABLE, lambda: TableFixture(ConfiguredSpec(resolve(TableSpec, spec), options)), without
    )


def study_kind_tests(
    spec: StudyKind, build: Callable[[], Any], without: Mapping[str, str] = NOTHING
) -> Tests[StudyKindFixture]:
    """Return tests of a kind of study, one item per requirement on its displays and its file.

    Parameters
    ----------
    spec : StudyKind
        The spec that the hook yields; it must be installed.
    build : callable
        Returns a small result, with its file if the kind has one.
    without
        See `contact_model_tests`.

    Returns
    -------
    callable
        See `contact_model_tests`.
    """
    return build_tests(STUDY_KIND, lambda: StudyKindFixture(spec, build()), without)
