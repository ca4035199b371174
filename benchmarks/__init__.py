"""What canhelm costs and how fast it is; ``python -m benchmarks`` measures it on this machine."""
