"""Search for the length of a step, and the allowance of the damage that it adds."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.errors import ContactError, StepError
from wearsim.evolution.steppers.base import SHRINK, SMALLEST_STEP, Trial
from wearsim.evolution.steppers.damage import OF_ALL, OF_STEP, damage_excess


def test_accepted_step_proposes_the_next_one() -> None:
    trial = Trial(1000.0, False)
    assert trial.accepts(0.4, 1000.0, 1.5)
    assert trial.proposed == pytest.approx(1500.0, rel=0.1)
    assert trial.rejected == 0
    assert trial.accepts(1.0, 200.0, 2.0)  # shortened by the stop
    assert trial.proposed == pytest.approx(1500.0, rel=0.1)
    assert trial.accepts(0.9, trial.proposed, 0.01)
    assert trial.proposed == pytest.approx(SHRINK * 1500.0, rel=0.1)


def test_rejected_steps_are_counted_and_shortened() -> None:
    trial = Trial(1000.0, False)
    assert not trial.accepts(1.01, 1000.0, 0.5)
    assert (trial.rejected, trial.proposed) == (1, pytest.approx(500.0, rel=0.1))
    assert not trial.accepts(1.01, 500.0, 0.95)
    assert (trial.rejected, trial.proposed) == (2, pytest.approx(350.0))
    trial.reject(StepError("too long"), 300.0)
    assert (trial.rejected, trial.proposed) == (3, pytest.approx(60.0))


def test_forced_steps_are_accepted_as_they_are() -> None:
    trial = Trial(123.4, True)
    assert trial.accepts(9.0, 123.4, 0.1)
    assert (trial.proposed, trial.rejected) == (123.4, 0)
    assert trial.step(0.0, 1000.0) == 123.4
    assert trial.step(850.0, 1000.0) == 123.4
    assert trial.step(950.0, 1000.0) == 50.0


def test_no_short_step_is_left_before_the_stop() -> None:
    trial = Trial(512.0, False)
    proposed = trial.proposed
    assert trial.step(0.0, 10.0 * proposed) == proposed
    assert trial.step(0.0, 1.5 * proposed) == 0.75 * proposed
    assert trial.step(0.0, proposed) == proposed
    assert Trial(proposed, False, taper=0.5).step(0.0, 1.9 * proposed) == 1.9 * proposed


def test_steps_that_become_too_short_end_the_test_with_their_cause() -> None:
    trial = Trial(2.0 * SMALLEST_STEP, False)
    trial.reject(StepError("edge", cause="edge"), SMALLEST_STEP)
    with pytest.raises(StepError, match=r"no step is short enough at pass 7 .*; edge"):
        trial.step(7.0, 100.0)
    trial.reject(StepError("contact is lost", cause="lost"), SMALLEST_STEP)
    trial.reject(ContactError("later"), SMALLEST_STEP)  # contacts fail close to zero load
    with pytest.raises(StepError, match=r"^contact is lost$"):
        trial.step(7.0, 100.0)


def test_damage_of_a_step_has_its_allowance() -> None:
    effective = np.array([[0.0, 0.1, 0.0], [0.3, 0.1, 0.0], [0.31, 0.12, 0.0]])
    allowed = 1e-3 * np.array([0.3 * (OF_STEP + OF_ALL), 0.1 * OF_ALL])
    expected = [*(np.array([0.01, 0.02]) / allowed), 0.0]
    np.testing.assert_allclose(damage_excess(effective, 1e-3), expected, rtol=1e-12)
