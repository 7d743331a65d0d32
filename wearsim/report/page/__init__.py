"""Report of results as one page for a browser."""
