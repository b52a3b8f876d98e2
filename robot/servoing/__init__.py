"""Visual servoing: what cameras see becomes where the joints go.

In come observations (pixels of the tip's marker and of the goal, each with the time of its picture)
and joint angles by the motors.  Out come joint angles to go to, and at the end a verdict.

loop.py               one run: receive, decide, move; begin reading here
sightings.py          pairs each picture with the joint angles of its time
measurement.py        many frames of an arm that stands become one measurement
servo.py              the servo law: one decision for each measurement
exploration.py        motions that show how the joints move the image
chain_model.py        the image as a function of the joints, fitted by least squares
local_jacobian.py     the image Jacobian at one place: Broyden's update, or a Kalman filter
pose_search.py        the joint angles at which the image is as wanted
stream.py             steering while the arm moves
loss_of_sight.py      causes of too little being seen, and when a run is given up
runs.py               runs as the laptop orders them, and their log
"""
