"""Synthetic ensembles in closed form: depth as a product of powers of the random inputs."""

from __future__ import annotations

import numpy as np

from tests.rig_text import BODIES
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.schema import DONE, FAILED, OBSERVABLES, PENDING
from wearsim.studies.ensemble.result import EnsembleResult

TITLE = "made up"
DEPTH = 20e-6  # of the mean inputs [m]
INPUTS = {
    "load.normal_force": ("N", 300.0, 30.0),
    "friction.coefficient": ("1", 0.1, 0.02),
    "roller.offset": ("m", 0.0, 1e-4),  # without effect
}
ROLLERS = 3


def made_up(
    count=200,
    plan="monte-carlo",
    failed=(),
    pending=0,
    spread=1.0,
    until="",
    scale=1.0,
    kept=None,
    seed=1,
):
    """Return an ensemble in which some realisations failed and the last ones are pending."""
    draws = np.random.default_rng(seed)
    drawn = {
        key: mean + spread * std * draws.standard_normal((count, ROLLERS) if unit == "m" else count)
        for key, (unit, mean, std) in INPUTS.items()
    }
    part = np.linspace(0.0, 1.0, 6)
    factor = np.abs(drawn["load.normal_force"] / 300.0 * drawn["friction.coefficient"] / 0.1)
    end = scale * DEPTH * factor ** (2.0 / 3.0)
    shapes = {
        "roller_depth": 0.0,
        "total_roller_worn_volume": 0.0,
        "width": 300.0,
        "worn_volume": 1e-3,
        "dissipated_energy": 1e8,
        "peak_pressure": 3e13,
    }
    observables = {
        name: shapes.get(name, 3e3) * end[:, None] * part for name in OBSERVABLES if name != "depth"
    }
    observables["depth"] = end[:, None] * part ** (2.0 / 3.0)
    y = np.linspace(-4e-3, 4e-3, 81)
    status = np.full(count, DONE, np.uint8)
    status[list(failed)] = FAILED
    status[count - pending :] = PENDING
    static = {
        "y": y,
        "multiplicity": np.array([3.0]),
        "record_passes": 1.35e6 * part,
        "record_time": 27000.0 * part,
    }
    scalars = {name: np.full(count, 1e-8) for name in ("depth_error", "volume_error")}
    scalars |= {name: np.full(count, 15.0) for name in ("steps", "solves")}
    control = end * (1.0 + 0.05 * draws.standard_normal(count))
    return EnsembleResult(
        EnsembleData(
            scenario_text=f'title = "{TITLE}"\n{BODIES}',
            scenario_file="rig.toml",
            title=TITLE,
            sha256="",
            seed=seed,
            model="slender",
            finished=not pending,
            wall_seconds=60.0,
            created="2030-01-01T00:00:00+00:00",
            stepper="implicit",
            tolerance=1e-3,
            width_threshold=1e-7,
            total_passes=1.35e6,
            total_time=27000.0,
            strip_width=1e-4,
            plan=plan,
            requested=count,
            until=until,
            inputs=[
                {"key": key, "unit": unit, "input": key, "rollers": "each" if unit == "m" else ""}
                for key, (unit, _, _) in INPUTS.items()
            ],
            groups=[
                {"name": key, "role": "scalar", "persistence": "per-test", "text": "normal"}
                for key in INPUTS
            ],
            control={"mean": DEPTH, "std": 3e-6, "draws": 10**6}
            if plan == "control-variate"
            else {},
            variables={
                **static,
                **drawn,
                **observables,
                **scalars,
                "control": control,
                "depth_profile": np.maximum(end[:kept, None] - y**2, 0.0),
            },
            status=status,
            errors={number: f"lost contact at pass {number}" for number in failed},
        )
    )
