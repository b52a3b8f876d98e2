"""The page: watch, pick, aim, start, stop; a web page, in a process of its own.

In: frames and status of the tracker, orders of browsers.  Out: orders to the brick, pictures and
figures for browsers, reports of runs.  Begin with `interface`, which both processes share.

interface    calls that the page may make of the tracker's process
controller   the tracker's side: runs, colours, drawings; `run_states` is its table of states
process      start and watch over the page's process
server       the page's side: NiceGUI, one page per browser; `browser` builds one
rpc          calls between the two processes
pulse        how the page knows that a browser is there; `silence` says why it is not
stop_gate    a second path for STOP
steering     which browser gives orders
cards/       the parts of the page
"""
