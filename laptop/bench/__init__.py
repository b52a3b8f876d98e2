"""Benches: the programs beside a reference method and the physical limit, on emulated arms.

In go seeds and options of the command `bench`.  Out come tables for people and, with --json, the
results field by field.  Begin with `bench`: a bench is a BenchRecord, and each module's BENCH is
one:

draw, plot      drawn lines and whole drawings; `plot_speed`: the time to order large ones
servo           visual servoing; `servo_setups` draws set-ups, `servo_table` holds its BENCH
track           the tracker: precision, light, printed rims and cost, each in a `track_*`
accuracy        the accuracy test by camera, beside the truth
calibrate, ilc  calibration of an arm, and learning of a path by a camera
workers, show   cases on all cores or a cluster; progress and tables
"""
