"""The commands: what is typed becomes one call.  Only here is click known.

In: arguments of the command line.  Out: calls of the other rooms, text for people, exit statuses.
Begin with `main`, then a command's own file.

main         entry point: errors become messages and exit statuses
start        environment of the process before anything is imported
groups       the tree of commands; `commands` helps with mistyped names
options      options that several commands share; `rules` says which go together
draw, track, touch, simulate, demo, calibrate, accuracy   the greater commands
exit_status  the meanings of exit statuses
"""
