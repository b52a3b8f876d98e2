"""Program of the brick: Python 3.5, the standard library and python-ev3dev2, nothing else.

In go arm files, jobs, and what a laptop's camera sees; out come motions of the motors. Begin with
`drawing` for drawing, with `visual_servoing` for servoing, with `api` for a program of one's own.

driver, drawing_commands, job_commands, touch_command, check_command   the commands of driver.py
visual_servoing, servoing_commands    the command that goes to a goal by sight
tracking, tracker_address, tracking_client   the link to the laptop's tracker
drawing, turtle_graphics              drawing by programs
command_line, program, asking, clock  what scripts have in common
ev3/, motion/, servoing/, jobs/, benching/   motors; motions; control by sight; jobs; measurements
"""
