"""The laptop's commands: `python -m laptop demo`, `track ...`, `simulate ...`, `bench ...`."""

import _signal  # type: ignore[import-not-found]  # `signal` takes a while to import
import sys

if __name__ == "__main__":
    # While importing there is nothing to end in order.
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
    try:
        from laptop.cli.main import main

        sys.exit(main())
    except ModuleNotFoundError as missing:
        sys.exit(
            f"laptop: {missing.name} is not installed here; run .uv/bin/uv run python -m laptop"
        )
