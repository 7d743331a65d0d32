"""Conformance tests for plugins: one line in an author's pytest puts a model to the test.

``test_sponge = contact_model_tests(SPEC)`` gives one item per promise that every contact model
keeps; random inputs, wear laws and loads have the same. A promise that is broken is told with its
numbers and with the place where it is written.
"""

from wearsim.testing.checks import Check, Checks, PromiseBroken
from wearsim.testing.contact_bench import STEEL, ContactCase
from wearsim.testing.kit import (
    contact_model_tests,
    load_tests,
    random_input_tests,
    wear_law_tests,
)
from wearsim.testing.wear_laws import sliding_contact

__all__ = [
    "STEEL",
    "Check",
    "Checks",
    "ContactCase",
    "PromiseBroken",
    "contact_model_tests",
    "load_tests",
    "random_input_tests",
    "sliding_contact",
    "wear_law_tests",
]
