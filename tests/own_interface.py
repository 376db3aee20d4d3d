# SPDX-License-Identifier: Apache-2.0
"""A CAN interface for one test alone."""

import atexit
import os
import shutil
import subprocess


def own_interface():
    """The name of a virtual CAN interface that nobody else talks on, gone when this process ends. Where this process may
    not make one it is vcan0, which the tests of a run use one after the other."""
    name = f"tendril{os.getpid()}"
    ip = shutil.which("ip", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")
    if os.geteuid() != 0 or not ip:
        return "vcan0"

    def link(*words):
        return subprocess.run([ip, "link", *words], capture_output=True, check=False).returncode == 0

    link("del", name)  # one that was killed had this number, too
    if not link("add", "dev", name, "type", "vcan"):
        return "vcan0"
    atexit.register(link, "del", name)
    return name if link("set", name, "up") else "vcan0"
