"""Entry point of `python -m wearsim`, equal to the command `wearsim`."""

from wearsim.cli.app import main

if __name__ == "__main__":
    main()
