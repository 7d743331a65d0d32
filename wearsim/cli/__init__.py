"""The shell: one module per verb; typer and rich live here and nowhere else."""
