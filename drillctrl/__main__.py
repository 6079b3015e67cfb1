"""`python -m drillctrl`: the command line."""

from drillctrl.cli import main

if __name__ == "__main__":
    main()
