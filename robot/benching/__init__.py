"""What `bench_brick.py` measures."""
