# Imports the Python module of the release build, for figures that need no installation.
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "build/release/python"))

import lucerna  # noqa: E402, F401
