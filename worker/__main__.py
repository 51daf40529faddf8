"""`python -m worker`: start one worker process, or several side by side."""

import argparse
import sys

from app.config import get_settings
from app.logs import configure_logs
from worker.main import work
from worker.supervisor import supervise


def main() -> int:
    """Read the command line and work until told to stop."""
    parser = argparse.ArgumentParser(prog="python -m worker", description=__doc__)
    parser.add_argument("--concurrency", type=int, default=0, help="processes; 0: the setting")
    parser.add_argument("--parent-pid", type=int, default=0, help="end when this process ends")
    arguments = parser.parse_args()
    configure_logs()
    settings = get_settings()
    count = arguments.concurrency or settings.worker_concurrency
    if count > 1:
        return supervise(settings, count, arguments.parent_pid)
    return work(settings, arguments.parent_pid)


if __name__ == "__main__":
    sys.exit(main())
