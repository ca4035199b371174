"""``python -m daemon`` is the command ``canhelm``."""

import sys

from daemon.cli.main import main

sys.exit(main())
