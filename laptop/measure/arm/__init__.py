"""An arm's own numbers, from where cameras saw its marker at many joint angles.

In: an arm's description, calibrated cameras, touches of the board, a rig.  Out: links, zeros,
backlash, the marker's offset, with standard uncertainties.  Begin with `calibrating`.

pose_plan         the most informative poses, and their job
arm_model         what the cameras would see of an arm with given numbers
arm_fit           robust least squares of these numbers
fault_hypotheses  fault hypotheses where no numbers explain what was seen
touching          touches of the board's crosses with the pen
arm_result        numbers that are worth being written into the arm's file
calibrating       the measurement, batch by batch
emulated_setups   emulated arms before cameras; `emulated_table` is an ideal one
"""
