"""Hooks that a plugin can implement, each with a complete example.

docs/plugins.md has a longer example of each; ``wearsim.testing`` tests the requirements.
"""

from __future__ import annotations

from collections.abc import Iterable

import pluggy

from wearsim.plugins.specs import ContactModelSpec, LoadSpec, RandomInputSpec, WearLawSpec

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
