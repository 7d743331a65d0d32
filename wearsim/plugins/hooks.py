"""Hooks that a plugin can implement."""

from __future__ import annotations

from collections.abc import Iterable

import pluggy

from wearsim.plugins.specs import (
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

PROJECT = "wearsim"

hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


class HookSpecs:
    """The hooks of the entry-point group `wearsim`."""

    @hookspec
    def wearsim_contact_models(self) -> Iterable[ContactModelSpec]:  # type: ignore[empty-body]
        """Yield contact models, selected in a scenario by ``contact.model``.

        The requirements are documented in `ContactModel` and `SingleContactModel` and tested by
        `wearsim.testing.contact_model_tests`; ``wearsim new plugin NAME`` writes a complete one.

        Returns
        -------
        iterable of ContactModelSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import ContactModelSpec, Options, hookimpl
            from my_package.foundation import Foundation


            class FoundationOptions(Options):
                foundation_modulus: float = 2.0e13  # Pa/m


            @hookimpl
            def wearsim_contact_models():
                yield ContactModelSpec(
                    name="foundation",
                    factory=Foundation,  # called with options, grid and materials
                    options=FoundationOptions,
                    summary="elastic foundation",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_wear_laws(self) -> Iterable[WearLawSpec]:  # type: ignore[empty-body]
        """Yield wear laws, selected in a scenario by ``wear.law``.

        The requirements are documented in `WearLaw` and tested by
        `wearsim.testing.wear_law_tests`.

        Returns
        -------
        iterable of WearLawSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Options, WearLaw, WearLawSpec, hookimpl


            class PerPass(Options):
                depth: float = 1e-12  # m, where the bodies slide


            class Constant(WearLaw):
                def __init__(self, options):
                    self.depth = options.depth

                def depth_per_pass(self, body, solution, rolling_speed):
                    return self.depth * (solution.dissipation > 0.0)


            @hookimpl
            def wearsim_wear_laws():
                yield WearLawSpec(
                    name="constant-depth",
                    factory=Constant,
                    options=PerPass,
                    summary="the same depth in every pass",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_loads(self) -> Iterable[LoadSpec]:  # type: ignore[empty-body]
        """Yield loads, selected by ``load.kind``, and terms, added by a table ``[load.NAME]``.

        The requirements are documented in `Load` and `LoadTerm` and tested by
        `wearsim.testing.load_tests`.

        Returns
        -------
        iterable of LoadSpec

        Examples
        --------
        .. code-block:: python

            import numpy as np
            from wearsim.plugins import Load, LoadSpec, Options, hookimpl


            class RampOptions(Options):
                start: float = 300.0  # N
                slope: float = 0.001  # N/s


            class Ramp(Load):
                def __init__(self, options):
                    self.options = options

                def force(self, time):
                    return self.options.start + self.options.slope * np.asarray(time)

                def mean(self, start, stop):
                    return float(self.force(0.5 * (start + stop)))

                def deviation(self, start, stop):
                    return abs(self.options.slope) * (stop - start) / 12**0.5


            @hookimpl
            def wearsim_loads():
                yield LoadSpec(
                    name="ramp",
                    factory=Ramp,
                    options=RampOptions,
                    summary="a rising load",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_random_inputs(self) -> Iterable[RandomInputSpec]:  # type: ignore[empty-body]
        """Yield random inputs, selected by ``distribution`` in the table that replaces a value.

        Options in the unit of the replaced value have the types `Value`, `PositiveValue` and
        `Limit`: "300 N" for a load, a plain number for a coefficient. The requirements are
        documented in `Distribution`, `JointDistribution`, `FrictionField` and `Process` and tested
        by `wearsim.testing.random_input_tests`.

        Returns
        -------
        iterable of RandomInputSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Distribution, Options, RandomInputSpec, Value, hookimpl


            class Bounds(Options):
                low: Value
                high: Value


            class Flat(Distribution):
                def __init__(self, options):
                    self.options = options

                def quantile(self, probability):
                    return self.options.low + (self.options.high - self.options.low) * probability


            @hookimpl
            def wearsim_random_inputs():
                yield RandomInputSpec(
                    name="flat",
                    factory=Flat,
                    options=Bounds,
                    summary="uniform between two bounds",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_motion_laws(self) -> Iterable[MotionLawSpec]:  # type: ignore[empty-body]
        """Yield motion laws, selected by ``law`` in the entries of ``cam.motion``.

        The requirements are documented in `MotionLaw` and tested by
        `wearsim.testing.motion_law_tests`.

        Returns
        -------
        iterable of MotionLawSpec

        Examples
        --------
        .. code-block:: python

            import numpy as np
            from wearsim.plugins import MotionLaw, MotionLawSpec, Options, hookimpl


            class Cosine(MotionLaw):
                def __init__(self, options, angle, rise, unit):
                    self.rate, self.height = np.pi / angle, 0.5 * rise

                def lift(self, angle):
                    turn = self.rate * angle
                    waves = 1.0 - np.cos(turn), np.sin(turn), np.cos(turn)
                    return self.height * np.stack([w * self.rate**k for k, w in enumerate(waves)])


            @hookimpl
            def wearsim_motion_laws():
                yield MotionLawSpec(
                    name="cosine",
                    factory=Cosine,
                    options=Options,
                    summary="half a period of a cosine",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_axial_profiles(self) -> Iterable[AxialProfileSpec]:  # type: ignore[empty-body]
        """Yield forms of bodies along their axis, selected by ``form`` in ``axial_profile``.

        The requirements are documented in `AxialProfile` and tested by
        `wearsim.testing.axial_profile_tests`.

        Returns
        -------
        iterable of AxialProfileSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import (
                AxialProfile,
                AxialProfileSpec,
                Options,
                PositiveLength,
                hookimpl,
            )


            class QuarticOptions(Options):
                length: PositiveLength
                drop: PositiveLength


            class Quartic(AxialProfile):
                def __init__(self, options, pair):
                    self.length, self.end = options.length, options.drop

                def drop(self, s):
                    return self.end * (2.0 * s / self.length) ** 4


            @hookimpl
            def wearsim_axial_profiles():
                yield AxialProfileSpec(
                    name="quartic",
                    factory=Quartic,
                    options=QuarticOptions,
                    summary="drop with the fourth power of the distance from the middle",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_fatigue_laws(self) -> Iterable[FatigueLawSpec]:  # type: ignore[empty-body]
        """Yield fatigue laws, selected by ``law`` of a body in the table ``[fatigue]``.

        The requirements are documented in `FatigueLaw` and tested by
        `wearsim.testing.fatigue_law_tests`.

        Returns
        -------
        iterable of FatigueLawSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import FatigueLaw, FatigueLawSpec, Options, hookimpl


            class PairOptions(Options):
                passes: float = 1e6  # life at a pressure of 1 GPa


            class NinthPower(FatigueLaw):
                def __init__(self, options, contact_modulus):
                    self.passes = options.passes

                def damage_per_pass(self, pressure):
                    return (pressure / 1e9) ** 9 / self.passes


            @hookimpl
            def wearsim_fatigue_laws():
                yield FatigueLawSpec(
                    name="ninth-power",
                    factory=NinthPower,
                    options=PairOptions,
                    summary="life that falls as the ninth power of the pressure",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_study_kinds(self) -> Iterable[StudyKind]:  # type: ignore[empty-body]
        """Yield kinds of studies, whose files all verbs for results open.

        The requirements are documented in `StudyKind`, `StudyResult` and `View` and tested by
        `wearsim.testing.study_kind_tests`.

        Returns
        -------
        iterable of StudyKind

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import StudyKind, hookimpl


            @hookimpl
            def wearsim_study_kinds():
                yield StudyKind(
                    name="survey",
                    summary="depths of several grooves",
                    result="my_package.survey:SurveyResult",
                    view="my_package.survey:SurveyView",
                    data="my_package.survey:SurveyData",
                    format="my-package-survey",
                    holds="depths of several grooves, from `wearsim survey`",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_tables(self) -> Iterable[TableSpec]:  # type: ignore[empty-body]
        """Yield tables of the scenario that the plugin owns; see `TableSpec`.

        Returns
        -------
        iterable of TableSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Options, PositiveLength, TableSpec, hookimpl


            class SurveyOptions(Options):
                spacing: PositiveLength = 1e-3  # between the grooves


            @hookimpl
            def wearsim_tables():
                yield TableSpec("survey", SurveyOptions, "grooves of a survey", protocol=2)
        """
