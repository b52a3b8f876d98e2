"""Motion of the arm: from a path in centimetres, or an aim that moves, to motor commands.

In: paths of the tip (cm), joint angles (rad) or an aim per control tick.  Out: speed set-points for
the motors, and the joint angles that their encoders show.  Begin reading with `arm`; then

    kinematics, chains, inverse_iteration   tip position <-> joint angles, Jacobian
    paths, knots, trajectory                from pieces of a path to timed joint set-points
    online_trajectory, feed                 set-points for a moving aim; slower, held, resumed
    backlash, gravity, following            from the links' set-points to the motors'
    control_loop, joint_controller, motor_model   one tick: observe, command, detect a stall
    homing, stops, homing_from_home, zero   the counts at joint angle zero: found and remembered
    mounting, jog_views, checked            which motor turns which joint, and which way
"""
