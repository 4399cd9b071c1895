"""Charts, stability figures and measures of a running service.

The laboratory and the tests share helpers, such as the recorded sink; they lie in tests/support.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[3] / "tests" / "support"))
