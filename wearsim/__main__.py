"""`python -m wearsim`, the same as the command `wearsim`."""

from wearsim.cli.app import main

if __name__ == "__main__":
    main()
