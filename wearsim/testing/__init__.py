"""Conformance tests for plugins, built by one line of a pytest module.

``test_sponge = contact_model_tests(SPEC)`` gives one test item for each requirement on a contact
model; the other kinds of plugins have equivalent functions. A failed item reports the measured
numbers, the requirement and the dotted name of the class or method that specifies it.
"""

from wearsim.testing.checks import Check, Checks, ConformanceError
from wearsim.testing.contact_fixtures import STEEL, ContactCase
from wearsim.testing.kit import (
    axial_profile_tests,
    contact_model_tests,
    fatigue_law_tests,
    load_tests,
    motion_law_tests,
    random_input_tests,
    study_kind_tests,
    table_tests,
    wear_law_tests,
)
from wearsim.testing.wear_and_loads import sliding_contact

__all__ = [
    "STEEL",
    "Check",
    "Checks",
    "ConformanceError",
    "ContactCase",
    "axial_profile_tests",
    "contact_model_tests",
    "fatigue_law_tests",
    "load_tests",
    "motion_law_tests",
    "random_input_tests",
    "sliding_contact",
    "study_kind_tests",
    "table_tests",
    "wear_law_tests",
]
