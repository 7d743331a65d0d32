"""Start profiles of a test: measured, or worn by an earlier one."""
