"""Measurements of an arm that does jobs before cameras: what brick and cameras report, combined.

In: an arm's description, a job, cameras' calibrations.  Out: the arm's numbers, its accuracy,
offsets that make its paths better.  Begin with `run_data`, then read one of the rooms.

arm/           an arm's own numbers
accuracy/      how accurately it goes to poses and along paths, after ISO 9283
ilc/           a camera teaches it a path: iterative learning control
demo/          all at once, on this computer alone
run_data       data of a run: motors by the brick, the marker by cameras; the rig's protocol
live_rig       a rig of a real brick and live cameras
emulated_rig   a rig of an emulated brick and cameras
"""
