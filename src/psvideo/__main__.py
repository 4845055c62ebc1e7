"""``python -m psvideo`` is the command ``psvideo``, for where scripts are not on the path."""

from psvideo.cli.app import main

if __name__ == "__main__":
    raise SystemExit(main())
