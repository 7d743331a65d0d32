"""Reading and writing of result files."""
