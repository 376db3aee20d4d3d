# SPDX-License-Identifier: Apache-2.0
"""What CiA 301 and CiA 402 say, for peers that know nothing of Tendril's own sources."""

SYNC, NMT, MASTER = 0x080, 0x000, 127
START, STOP, PRE_OPERATIONAL_COMMAND, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F

# Statusword: mask and value of each state of the power drive system.
STATES = {
    "not ready to switch on": (0x4F, 0x00),
    "switch on disabled": (0x4F, 0x40),
    "ready to switch on": (0x6F, 0x21),
    "switched on": (0x6F, 0x23),
    "operation enabled": (0x6F, 0x27),
    "quick stop active": (0x6F, 0x07),
    "fault reaction active": (0x4F, 0x0F),
    "fault": (0x4F, 0x08),
}


def state_of(statusword):
    states = [name for name, (mask, value) in STATES.items() if int(statusword) & mask == value]
    assert len(states) == 1, f"statusword {int(statusword):04X} is of no state"
    return states[0]


def without_repeats(values):
    """A list with each run of equal values as one."""
    values = list(values)
    return [value for i, value in enumerate(values) if i == 0 or value != values[i - 1]]
