"""The recorded session that the package brings, shown live."""

from pathlib import Path

CAPTURE = Path(__file__).parent / "capture"
