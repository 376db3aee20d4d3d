# SPDX-License-Identifier: Apache-2.0
"""What the program validate printed, case by case."""


class Picture:
    def __init__(self, line):
        self.title, self.x, self.y, self.logarithmic = (line[key] for key in ("title", "x", "y", "logarithmic"))
        self.series = []  # lines of kind "series"


class Case:
    def __init__(self, line):
        self.name, self.title = line["name"], line["title"]
        self.rows = []      # lines of kind "row"
        self.pictures = []
        self.skipped = []   # reasons
        self.failed = []    # reasons

    def passed(self):
        return not self.failed and all(row["passed"] for row in self.rows)


def cases_of(lines):
    """The lines of all cases, in order; docs/validation.md describes them."""
    cases = []
    for line in lines:
        kind = line["kind"]
        if kind == "case":
            cases.append(Case(line))
        elif kind == "row":
            cases[-1].rows.append(line)
        elif kind == "picture":
            cases[-1].pictures.append(Picture(line))
        elif kind == "series":
            cases[-1].pictures[-1].series.append(line)
        elif kind in ("skipped", "failed"):
            getattr(cases[-1], kind).append(line["why"])
    return cases
