"""Linux with a CAN bus on machines whose kernel has none: Debian's user-mode kernel, booted over the host's files."""
