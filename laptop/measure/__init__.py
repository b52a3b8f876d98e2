"""Whatever lets an arm move by a job before cameras: what both say, side by side.

arm/       an arm's own numbers
accuracy/  how accurately it goes to poses and along paths, after ISO 9283
ilc/       a camera teaches it a path: iterative learning control
demo/      all at once, on this computer alone
"""
