#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Under which terms Tendril comes: every file says so, and no program calls what is under the GPL."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DAEMON = sys.argv.pop(1)
LINE = "SPDX-License-Identifier: Apache-2.0"
# Of CHOLMOD, the parts under the GPL: Supernodal, Modify, MatrixOps.
GPL = re.compile(r"cholmod_(super|updown|rowadd|rowdel|sdmult|ssmult|submatrix|horzcat|vertcat|scale|norm|symmetry|drop)")


class LicenceTest(unittest.TestCase):
    def test_every_source_file_names_the_licence(self):
        without = []
        for folder in ("app", "fem", "hal", "qp", "rt", "tests", "tools"):
            for file in (ROOT / folder).rglob("*"):
                if file.suffix in (".h", ".cpp", ".py", ".js", ".css", ".cmake") or file.name == "CMakeLists.txt":
                    if file.is_file() and "node_modules" not in file.parts and LINE not in file.read_text().split("\n\n")[0]:
                        without.append(str(file.relative_to(ROOT)))
        self.assertEqual(without, [])

    def test_of_cholmod_only_what_is_under_the_lgpl_is_called(self):
        with tempfile.TemporaryDirectory() as folder:
            # The loader writes which functions are bound, at their first call.
            environment = {**os.environ, "LD_DEBUG": "bindings", "LD_DEBUG_OUTPUT": f"{folder}/bound"}
            environment.pop("LD_BIND_NOW", None)
            subprocess.run([DAEMON, ROOT / "config/finger.yaml", "--simulate", "0.5"], env=environment, check=True,
                           capture_output=True, timeout=60 * float(os.environ.get("TENDRIL_PATIENCE", 1)))
            said = "".join(file.read_text() for file in Path(folder).iterdir())
        called = set(re.findall(r"symbol `(cholmod_\w+)'", said))
        self.assertIn("cholmod_analyze", called)
        self.assertEqual([name for name in called if GPL.match(name)], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
