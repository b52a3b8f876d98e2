#!/usr/bin/env python3
# A menu on the buttons; up/down choose, enter runs, left leaves.
import os
import sys
import time

from ev3dev2.button import Button
from ev3dev2.console import Console
from ev3dev2.led import Leds
from ev3dev2.motor import MediumMotor, OUTPUT_C
from ev3dev2.power import PowerSupply

os.system('setfont Lat15-TerminusBold14')
btn = Button()
leds = Leds()
pen = MediumMotor(OUTPUT_C)
items = ['pen up', 'pen down', 'battery']
state = {'choice': 0, 'running': True}


def show():
    print('\x1Bc', end='')
    print('> ' + items[state['choice']])


def up(pressed):
    if pressed:
        state['choice'] = (state['choice'] - 1) % len(items)
        show()


def down(pressed):
    if pressed:
        state['choice'] = (state['choice'] + 1) % len(items)
        show()


def enter(pressed):
    if not pressed:
        return
    leds.set_color('LEFT', 'AMBER')
    item = items[state['choice']]
    if item == 'battery':
        print('%.2f V' % PowerSupply().measured_volts)
    else:
        pen.on_for_degrees(30, 40 if item == 'pen down' else -40)
        print(item, 'done')
    leds.set_color('LEFT', 'GREEN')


def left(pressed):
    state['running'] = False


btn.on_up, btn.on_down, btn.on_enter, btn.on_left = up, down, enter, left
show()
while state['running']:
    btn.process()
    time.sleep(0.01)
Console().reset_console()
sys.exit(3)
