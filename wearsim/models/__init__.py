"""Built-in models, laws, loads and random inputs, registered by the hooks of plugins."""

from __future__ import annotations

from collections.abc import Iterable

from wearsim.models import axial, fatigue, loads, motion, wear
from wearsim.models.contact import hertz as hertz_model, hertz_fastsim, slender, strip_model
from wearsim.models.random import distributions, posterior, varying
from wearsim.plugins import (
    AxialProfileSpec,
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    RandomInputSpec,
    WearLawSpec,
    hookimpl,
)


@hookimpl
def wearsim_contact_models() -> Iterable[ContactModelSpec]:
    """Yield the built-in contact models."""
    return (hertz_fastsim.SPEC, hertz_model.SPEC, strip_model.SPEC, slender.SPEC)


@hookimpl
def wearsim_wear_laws() -> Iterable[WearLawSpec]:
    """Yield the built-in wear laws."""
    return wear.SPECS


@hookimpl
def wearsim_loads() -> Iterable[LoadSpec]:
    """Yield the built-in loads and load terms."""
    return loads.SPECS


@hookimpl
def wearsim_random_inputs() -> Iterable[RandomInputSpec]:
    """Yield the built-in distributions, friction fields and processes."""
    return (*distributions.SPECS, *posterior.SPECS, *varying.SPECS)


@hookimpl
def wearsim_motion_laws() -> Iterable[MotionLawSpec]:
    """Yield the built-in motion laws of cams."""
    return motion.SPECS


@hookimpl
def wearsim_fatigue_laws() -> Iterable[FatigueLawSpec]:
    """Yield the built-in fatigue laws."""
    return fatigue.SPECS


@hookimpl
def wearsim_axial_profiles() -> Iterable[AxialProfileSpec]:
    """Yield the built-in forms of bodies along their axis."""
    return axial.SPECS
