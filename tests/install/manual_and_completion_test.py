#!/usr/bin/env python3
"""Checks that the manual page and bash's completion have every command and option of --help; completion offers files.

usage: tests/install/manual_and_completion_test.py LUCERNA
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

LUCERNA = Path(sys.argv.pop(1)).resolve()


def lucerna(*words):
    return subprocess.run([LUCERNA, *words], check=True, capture_output=True, text=True).stdout


def section(text, title):
    """Returns the lines of a section of --help."""
    lines = text.splitlines()
    if title not in lines:
        return []
    rest = lines[lines.index(title) + 1:]
    return rest[:rest.index("")] if "" in rest else rest


def commands(path=()):
    """Yields `path` and all commands below it, as tuples of words."""
    yield path
    for line in section(lucerna(*path, "--help"), "Subcommands:"):
        if re.match(r"  \w", line):
            yield from commands((*path, line.split()[0]))


def options(path):
    """Returns the names of a command's options, short and long."""
    names = []
    for line in section(lucerna(*path, "--help"), "Options:"):
        if re.match(r"  -", line):
            names += line.split()[0].split(",")
    return names


COMMANDS = list(commands())


class Manual(unittest.TestCase):
    def test_Page_NamesEveryCommandAndOption(self):
        page = lucerna("--manual").replace("\\-", "-")
        sections = {title: text for title, text in re.findall(r"^\.S[SH] (.*)\n((?:(?!\.S[SH] ).*\n)*)", page, re.M)}
        self.assertGreaterEqual(len(COMMANDS), 18)
        for path in COMMANDS:
            title = " ".join(("lucerna", *path)) if path else "OPTIONS"
            with self.subTest(title):
                self.assertIn(title, sections)
                for name in options(path):
                    self.assertIn(f"\\fB{name}\\fR", sections[title])

    def test_Page_IsSetWithoutAWarning(self):
        result = subprocess.run(["groff", "-man", "-ww", "-Kutf8", "-Tutf8", "-rLL=200n", "-P-cbou"], input=lucerna("--manual"),
                                check=True, capture_output=True, text=True)
        self.assertEqual(result.stderr, "")
        self.assertIn("lucerna render room.pbrt --spp 4096 --checkpoint room.checkpoint --resume room.checkpoint",
                      result.stdout)
        self.assertNotIn("\\", result.stdout.replace("\\xNN", ""))


class Reference(unittest.TestCase):
    def test_PageOfTheDocs_IsTheProgramsOutput(self):
        docs = Path(__file__).resolve().parents[2] / "docs" / "reference" / "commands.md"
        self.assertEqual(docs.read_text(encoding="utf-8"), lucerna("--reference"),
                         "docs/reference/commands.md is made anew by: lucerna --reference > docs/reference/commands.md")


class Completion(unittest.TestCase):
    """Calls the function as bash does, without a terminal."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        (self.folder / "lucerna.bash").write_text(lucerna("--bash-completion"))
        for name in ("room.pbrt", "room two.pbrt", "room.exr", "room.json", "notes.txt"):
            (self.folder / name).touch()
        (self.folder / "rooms").mkdir()

    def complete(self, *words):
        """Returns the completions offered for the last word."""
        script = ('source ./lucerna.bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _lucerna; '
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        result = subprocess.run(["bash", "--norc", "-u", "-c", script, "bash", "lucerna", *words], cwd=self.folder, check=True,
                                capture_output=True, text=True)
        self.assertEqual(result.stderr, "")
        return sorted(line for line in result.stdout.splitlines() if line)

    def test_Commands_AreOffered(self):
        self.assertEqual(self.complete(""), sorted(path[0] for path in COMMANDS if len(path) == 1))
        self.assertEqual(self.complete("re"), ["relight", "render"])
        self.assertEqual(self.complete("light", "i"), ["import", "info"])
        self.assertEqual(self.complete("nothing"), [])

    def test_EveryOption_IsOffered(self):
        for path in COMMANDS:
            with self.subTest(path):
                self.assertEqual(self.complete(*path, "-"), sorted(options(path)))
        self.assertEqual(self.complete("render", "room.pbrt", "--sp"), ["--spp"])

    def test_Files_AreOfferedByTheirSuffix(self):
        self.assertEqual(self.complete("render", "ro"), ["room two.pbrt", "room.pbrt", "rooms"])
        self.assertEqual(self.complete("render", "room.pbrt", "-o", "ro"), ["room.exr", "rooms"])
        self.assertEqual(self.complete("render", "--stats", ""), ["room.json", "rooms"])
        self.assertEqual(self.complete("render", "no"), ["notes.txt"], "of no file of the suffix, any")
        self.assertEqual(self.complete("compare", "room."), ["room.exr", "room.json", "room.pbrt"])
        self.assertEqual(self.complete("study", "-o", ""), ["rooms"])

    def test_AWordOfAnOption_IsNoCommand(self):
        self.assertEqual(self.complete("render", "light", "room.e"), ["room.exr"])

    def test_Values_AreOfferedWhereTheyAreKnown(self):
        methods = ["path", "photonmap", "progressive"]
        self.assertEqual(self.complete("render", "--integrator", "p"), methods)
        self.assertEqual(self.complete("render", "--integrator", "=", "p"), methods)
        self.assertEqual(self.complete("render", "--integrator", "="), sorted(["direct", "igi", *methods]))
        self.assertEqual(self.complete("render", "--spp", ""), [])


if __name__ == "__main__":
    unittest.main()
