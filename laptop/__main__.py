"""The laptop's commands: `python -m laptop demo`, `track ...`, `simulate ...`, `bench ...`."""

import signal
import sys

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while importing there is nothing to end in order
    try:
        from laptop.cli.main import main

        sys.exit(main())
    except ModuleNotFoundError as missing:
        sys.exit(
            f"laptop: {missing.name} is not installed here; run .uv/bin/uv run python -m laptop"
        )
