"""The service with each turn of its event loop timed.

`python -m hapticvlm_lab.bench.latency.timed_service serve ...` is `hapticvlm serve ...` whose last
line is {"turns": [[callback, us of processor time]]}, in order.
"""

from __future__ import annotations

import json
import sys

from hapticvlm_lab.bench.latency.timed_loop import report, time_turns

if __name__ == "__main__":  # the children of the service import this file, and time nothing
    from hapticvlm.commands.main import main

    turns = time_turns()
    status = main()
    print(json.dumps(report(turns)))
    sys.exit(status)
