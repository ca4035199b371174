"""The control station: robots in a browser. A process of its own, a client of daemons like any other."""
