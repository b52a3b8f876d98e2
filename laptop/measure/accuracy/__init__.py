"""Accuracy of an arm at poses and along paths, after ISO 9283, measured by cameras.

In: an arm, calibrated cameras, a rig.  Out: accuracy and repeatability, mm, with uncertainties.
Begin with `accuracy_test`.

plan           poses and paths of the test, and its job
sighting       from pixels to the tip's places in the arm's frame, with covariances
crossings      crossings of planes across a path
criteria       the standard's figures
accuracy_test  the test: run, evaluation, uncertainties by Monte Carlo
report         the run's tables and files; `plots` draws its page
emulated       cameras and a rig for an emulated arm; `truth` is what it truly did
"""
