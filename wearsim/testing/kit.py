"""What an author calls: tests of a contact model, a random input, a wear law or a load."""

from __future__ import annotations

from collections.abc import Mapping

from wearsim.plugins import ContactModelSpec, LoadSpec, RandomInputSpec, WearLawSpec
from wearsim.testing import loads, random_inputs
from wearsim.testing.checks import Checks
from wearsim.testing.contact_bench import ContactBench, ContactCase
from wearsim.testing.contact_capabilities import CAPABILITIES
from wearsim.testing.contact_manners import MANNERS
from wearsim.testing.contact_pass_loop import PASS_LOOP
from wearsim.testing.contact_sums import SUMS
from wearsim.testing.items import Tests, tests_of
from wearsim.testing.loads import LoadBench
from wearsim.testing.random_bench import RandomBench
from wearsim.testing.specs import Chosen, found, spec_checks
from wearsim.testing.wear_laws import WEAR_LAW, WearLawBench
from wearsim.units import Kind

CONTACT_MODEL: Checks[ContactBench] = Checks(spec_checks(), SUMS, MANNERS, CAPABILITIES, PASS_LOOP)
NOTHING: Mapping[str, str] = {}


def contact_model_tests(
    spec: ContactModelSpec | str,
    options: Mapping[str, object] = NOTHING,
    case: ContactCase | None = None,
    without: Mapping[str, str] = NOTHING,
) -> Tests[ContactBench]:
    """Return tests of a contact model, one per promise.

    Parameters
    ----------
    spec : ContactModelSpec or str
        What its hook yields, or the name of an installed one.
    options : mapping of str to object
        Its options as a scenario would write them, quantities with their units.
    case : ContactCase, optional
        The contact to start from; by default the test rig's.
    without : mapping of str to str
        Checks that are left out, by name, and why; they are reported as skipped.

    Returns
    -------
    callable
        A parametrised test, to be bound to a name that begins with ``test``.
    """

    def build() -> ContactBench:
        return ContactBench(Chosen(found(ContactModelSpec, spec), options), case or ContactCase())

    return tests_of(CONTACT_MODEL, build, without)


def random_input_tests(
    spec: RandomInputSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    kind: Kind | None = None,
    files: Mapping[str, str] = NOTHING,
    marginal: tuple[RandomInputSpec | str, Mapping[str, object]] | None = None,
    without: Mapping[str, str] = NOTHING,
) -> Tests[RandomBench]:
    """Return tests of a random input, one per promise that its role makes.

    Parameters
    ----------
    spec : RandomInputSpec or str
        What its hook yields, or the name of an installed one.
    options : mapping of str to object
        Its options as a scenario would write them.
    kind : Kind, optional
        What it stands for, so that values have a unit; nothing for a plain number.
    files : mapping of str to str
        Content of the files that the options name.
    marginal : tuple of spec and options, optional
        Distribution at any one point or time; for a field and a process.
    without : mapping of str to str
        As of `contact_model_tests`.

    Returns
    -------
    callable
        As of `contact_model_tests`.
    """
    own = found(RandomInputSpec, spec)

    def build() -> RandomBench:
        chosen = Chosen(own, options, kind, files)
        if marginal is None:
            return RandomBench(chosen)
        name, values = marginal
        return RandomBench(chosen, Chosen(found(RandomInputSpec, name), values, kind, files))

    return tests_of(random_inputs.BY_ROLE[own.role], build, without)


def wear_law_tests(
    spec: WearLawSpec | str,
    options: Mapping[str, object] = NOTHING,
    without: Mapping[str, str] = NOTHING,
) -> Tests[WearLawBench]:
    """Return tests of a wear law, one per promise; parameters as of `contact_model_tests`."""
    return tests_of(
        WEAR_LAW, lambda: WearLawBench(Chosen(found(WearLawSpec, spec), options)), without
    )


def load_tests(
    spec: LoadSpec | str,
    options: Mapping[str, object] = NOTHING,
    *,
    files: Mapping[str, str] = NOTHING,
    duration: float = 3600.0,
    without: Mapping[str, str] = NOTHING,
) -> Tests[LoadBench]:
    """Return tests of a load or of a term, one per promise that its role makes.

    Parameters
    ----------
    spec, options, without
        As of `contact_model_tests`.
    files : mapping of str to str
        Content of the files that the options name.
    duration : float
        Time over which a load without a span is looked at, and a term followed [s].

    Returns
    -------
    callable
        As of `contact_model_tests`.
    """
    own = found(LoadSpec, spec)

    def build() -> LoadBench:
        return LoadBench(Chosen(own, options, files=files), duration)

    return tests_of(loads.BY_ROLE[own.role], build, without)
