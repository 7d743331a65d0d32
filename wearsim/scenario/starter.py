"""The commented scenario that a new one starts from."""

from __future__ import annotations

from pathlib import Path

_STARTER = Path(__file__).with_suffix(".toml")


def starter_scenario() -> str:
    """Return a scenario that runs as it stands, with its alternatives in comments."""
    return _STARTER.read_text(encoding="utf-8")
