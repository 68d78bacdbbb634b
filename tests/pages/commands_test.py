#!/usr/bin/env python3
"""Checks that every command line on the pages, in blocks and spans of code, uses subcommands and options listed by --help.

Usage: commands_test.py LUCERNA REPOSITORY
"""
import os
import re
import shlex
import subprocess
import sys

# The program's name may follow variables and a command that starts it, as under MPI or Slurm.
COMMAND = re.compile(r"^(?:\w+=\S+ +)*(?:(?:mpirun|srun|time|apptainer|podman)\b.*? )?"
                     r"(?:\$lucerna|\"\$lucerna\"|lucerna|build/release/lucerna)(?= )(.*)$")


def blocks_of(page):
    """Yields lines of fenced and indented code, joined where a backslash continues them, and spans; each with its line number."""
    fenced, begun, number = False, "", 0
    for at, line in enumerate(page.split("\n"), 1):
        if re.match(r"\s*```", line):
            fenced = not fenced
            continue
        if not begun:
            if not (fenced or line.startswith("    ")):
                for span in re.findall(r"`((?:\$)?lucerna [^`]+)`", line):
                    yield at, span
                continue
            number = at
        begun += line.strip()
        if begun.endswith("\\"):
            begun = begun[:-1] + " "
            continue
        yield number, begun
        begun = ""


def commands_of(page):
    """Yields (line, words after the program's name) of each command; a line may hold several, joined by &&, |, ; or $( )."""
    for number, line in blocks_of(page):
        try:
            line = re.sub(r"(^|\s)#.*$", "", line)  # a comment; the # of a colour is kept
            lexer = shlex.shlex(line.replace("$lucerna", "lucerna"), posix=True, punctuation_chars="|&;<>()")
            lexer.whitespace_split = True
            lexer.commenters = ""
            words = list(lexer)
        except ValueError:  # not a line of a shell
            continue
        parts = [[]]
        for word in words:
            if re.fullmatch(r"[|&;()]+", word):
                parts.append([])
            elif re.fullmatch(r"[<>]+", word):
                parts[-1].append(">")
            else:
                parts[-1].append(word)
        for part in parts:
            text = " ".join(part)
            if not COMMAND.match(text):
                continue
            first = next(i for i, word in enumerate(part) if word in ("lucerna", "build/release/lucerna"))
            part = part[first + 1:]
            if ">" in part:
                part = part[:part.index(">")]
            if part and re.fullmatch(r"-{0,2}[a-z][\w-]*", part[0]):
                yield number, part


class Helps:
    """The options and subcommands that --help lists, queried once for each command."""

    def __init__(self, program):
        self.program, self.known = program, {}

    def of(self, *command):
        if command not in self.known:
            text = subprocess.run([self.program, *command, "--help"], capture_output=True, text=True, check=True).stdout
            options = set()
            for line in re.findall(r"^  (-.*)$", text, re.M):
                options.update(re.findall(r"(?<![\w-])(--?[a-z][\w-]*)", re.split(r"\s", line)[0]))
            listed = re.search(r"^Subcommands:\n((?:  .*\n)+)", text, re.M)
            subcommands = set(re.findall(r"^  ([a-z]+)", listed[1], re.M)) if listed else set()
            self.known[command] = options, subcommands
        return self.known[command]


def faults_of(helps, words):
    """Returns the subcommands and options of a command line that the program does not have."""
    command = []
    options, subcommands = helps.of()
    while words and subcommands and not words[0].startswith("-"):
        if words[0] not in subcommands:
            return [f"no command {' '.join(command + [words[0]])}"]
        command.append(words[0])
        words = words[1:]
        options, subcommands = helps.of(*command)
    named = [word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    return [f"lucerna {' '.join(command)} has no {name}" for name in named if name not in options]


def pages_of(root):
    """Returns README.md and the pages of docs/ and scenes/, relative to the repository."""
    pages = ["README.md"]
    for top in ("docs", "scenes"):
        pages += [os.path.relpath(os.path.join(folder, name), root) for folder, _, names in os.walk(os.path.join(root, top))
                  for name in sorted(names) if name.endswith(".md")]
    return pages


def main():
    helps = Helps(sys.argv[1])
    root = sys.argv[2]
    example = list(commands_of("    $lucerna light impart a\n\n```\nmpirun -n 2 lucerna render a --ernor 2% \\\n --png\n```\n"
                               "| `lucerna lux a --hight 1` |\n"))
    assert len(example) == 3 and all(len(faults_of(helps, words)) == 1 for _, words in example), example
    faults, commands = [], 0
    for page in pages_of(root):
        page = os.path.join(root, page)
        with open(page, encoding="utf-8") as file:
            for number, words in commands_of(file.read()):
                commands += 1
                faults += [f"{os.path.relpath(page, root)}:{number}: {fault}" for fault in faults_of(helps, words)]
    print("\n".join(faults) or f"{commands} command lines: all known")
    if commands < 150:
        sys.exit("too few command lines found")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
