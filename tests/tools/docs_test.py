#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What README and the pages mention is there: names, files, links, commands and their options."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
FOLDERS = ("app", "fem", "hal", "qp", "rt", "tests", "tools", "config", "docs", ".ci")
NAMESPACES = ("app", "fem", "hal", "qp", "rt")
PLACEHOLDER = re.compile(r"[A-Z]{2,}|[*<>]|\.\.\.")  # NAME, FILE, *
# The programs, with the sources that declare their options.
PROGRAMS = {
    "tendrild": ("app/tendrild.cpp", "app/program/command_line.cpp"),
    "tendril-plant": ("app/tendril_plant.cpp", "app/program/command_line.cpp"),
    "tendrilctl": ("app/tendrilctl.cpp", "app/program/command_line.cpp"),
    "tendril-view": ("app/tendril_view.cpp", "app/program/command_line.cpp"),
    "tendril-latency": ("tools/tendril_latency.cpp", "app/program/command_line.cpp"),
}


def code_in(page):
    """The pieces in backticks, and the lines of indented and fenced blocks."""
    text = page.read_text()
    fenced = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
    blocks = [line for block in fenced.findall(text) for line in block.splitlines()]
    blocks += [line.strip() for line in fenced.sub("", text).splitlines() if line.startswith("    ")]
    return re.findall(r"`([^`\n]+)`", fenced.sub("", text)) + blocks


def headers(namespace):
    return [file.read_text() for file in sorted((ROOT / namespace).rglob("*.h"))]


def anchor(heading):
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def tool_text(name):
    """The source of a command of tools/, with all that it may hand its options to."""
    path = ROOT / "tools" / name
    text = path.read_text()
    for other in re.findall(r"[\w/]+\.(?:py|cpp|sh)\b|\b\w+_benchmark\b", text):
        for file in ROOT.glob(f"tools/**/{Path(other).stem}.*"):
            text += file.read_text()
    for word in re.findall(r"\b(?:from|import) (\w+)", text):
        for file in (ROOT / "tools" / word).glob("*.py"):
            text += file.read_text()
    for program, sources in PROGRAMS.items():
        if program in text:
            text += "".join((ROOT / source).read_text() for source in sources)
    return text


def mentioned(pattern):
    """What the code of the pages has that matches: page, piece of code, match."""
    for page in PAGES:
        for code in code_in(page):
            for found in re.findall(pattern, code):
                yield page.relative_to(ROOT).as_posix(), code, found


class DocsTest(unittest.TestCase):
    def test_every_name_in_a_namespace_is_declared_there(self):
        for page, code, (namespace, names) in mentioned(rf"\b({'|'.join(NAMESPACES)})::((?:\w+::)*\w+)"):
            parts = [re.compile(rf"\b{part}\b") for part in names.split("::")]
            with self.subTest(page=page, code=code):
                self.assertTrue(any(all(part.search(text) for part in parts) for text in headers(namespace)))

    def test_every_file_is_there(self):
        for page, code, path in mentioned(rf"(?<![\w/.-])((?:{'|'.join(FOLDERS)})/[\w./*@-]*[\w*])"):
            with self.subTest(page=page, code=code, path=path):
                self.assertTrue(
                    PLACEHOLDER.search(path) or (ROOT / path).exists() or list(ROOT.glob(path + ".*")))

    def test_every_link_leads_somewhere(self):
        for page in PAGES:
            for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
                if re.match(r"\w+:", target):
                    continue
                with self.subTest(page=page.name, link=target):
                    name, _, section = target.partition("#")
                    file = (page.parent / name).resolve() if name else page
                    self.assertTrue(file.exists())
                    if section:
                        headings = re.findall(r"^#+ (.*)$", file.read_text(), re.MULTILINE)
                        self.assertIn(section, [anchor(heading) for heading in headings])

    def test_every_option_of_a_tool_is_one(self):
        for page, code, (tool, options) in mentioned(r"\btools/([\w-]+)((?: +[^|;&#(]*)?)"):
            if (ROOT / "tools" / tool).is_file():
                text = tool_text(tool)
                own = re.split(r" (?:tools/|ctest|tendril|bash|candump)", options)[0]
                for option in re.findall(r"(?<!\S)(--[a-z][\w-]*)", own):
                    with self.subTest(page=page, code=code, option=option):
                        self.assertTrue(option in text)

    def test_every_option_of_a_program_is_one(self):
        programs = "|".join(PROGRAMS)
        for page, code, (program, options) in mentioned(rf"(?:^|[\s/])({programs}) ([^|;&#(]*)"):
            text = "".join((ROOT / source).read_text() for source in PROGRAMS[program]) + "--help"
            for option in re.findall(r"(?<!\S)(--[a-z][\w-]*)", options):
                with self.subTest(page=page, code=code, option=option):
                    self.assertTrue(option in text)


if __name__ == "__main__":
    unittest.main()
