"""wearsim: the wear of rolling contacts, stepped through millions of roller passes."""
