"""`python -m drillctrl`: the command line."""

import sys


def main() -> None:
    """Run the command line; an interrupt while it is loaded ends it as any other does."""
    try:
        from drillctrl.cli import main as run

        run()
    except KeyboardInterrupt:
        print("drillctrl: interrupted", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
