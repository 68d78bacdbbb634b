#!/usr/bin/env python3
"""Checks that every relative link of the pages leads to a file, every anchor to a heading, and that every docs/... named in a
source exists.

Usage: links_test.py REPOSITORY
"""
import os
import re
import subprocess
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(r"(?<![\w./-])docs/[\w/-]+\.(?:md|sbatch)\b")
SOURCES = (".h", ".cpp", ".py", ".sh", ".md", ".txt", ".cmake", ".pbrt", ".toml", ".sbatch", ".json", ".js", ".html",
           "Containerfile", "control", "rules")


def files_of(root):
    """Files of the repository, of a tree that git does not know too."""
    try:
        listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"], capture_output=True,
                                text=True, check=True).stdout.splitlines()
        return [name for name in listed if os.path.isfile(os.path.join(root, name))]
    except (OSError, subprocess.CalledProcessError):
        return [os.path.relpath(os.path.join(folder, name), root)
                for top in ("docs", "scenes", "engine", "lights", "photon", "kdtree", "tests", "bench", "scripts", "python")
                for folder, _, names in os.walk(os.path.join(root, top)) for name in names] + ["README.md"]


def without_code(page):
    """Returns the page without its blocks and spans of code, where a bracket before a parenthesis is not a link."""
    page = re.sub(r"^```.*?^```", "", page, flags=re.M | re.S)
    page = re.sub(r"^    .*$", "", page, flags=re.M)
    return re.sub(r"(?<!\[)`[^`\n]*`", "", page)


def anchors_of(page):
    """Anchors of headings, as GitHub makes them."""
    anchors = set()
    for heading in re.findall(r"^#+ (.*)$", page, re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        anchors.add(re.sub(r"[^\w\- ]", "", heading).replace(" ", "-"))
    return anchors


def broken_links(root, name, page):
    """Links of the page `name` that lead nowhere."""
    for link in LINK.findall(without_code(page)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = os.path.normpath(os.path.join(root, os.path.dirname(name), path)) if path else os.path.join(root, name)
        if not os.path.exists(target):
            yield f"{name}: {link} does not exist"
        elif anchor and target.endswith(".md"):
            with open(target, encoding="utf-8") as file:
                if anchor not in anchors_of(file.read()):
                    yield f"{name}: no heading #{anchor} in {os.path.relpath(target, root)}"


def missing_names(root, name, text):
    """Files of docs/ that the text names and that do not exist."""
    for named in NAMED.findall(text):
        if not os.path.exists(os.path.join(root, named)):
            yield f"{name}: {named} does not exist"


def main():
    root = os.path.abspath(sys.argv[1])
    assert list(broken_links(root, "README.md", "[a](no-such-page.md) [b](#no-such-heading)\n# A heading")), "not found"
    assert list(missing_names(root, "a.h", "// docs" + "/no-such-page.md")), "not found"
    assert anchors_of("## With `code`, and: more") == {"with-code-and-more"}
    faults, pages = [], 0
    for name in files_of(root):
        if not name.endswith(SOURCES):
            continue
        with open(os.path.join(root, name), encoding="utf-8", errors="replace") as file:
            text = file.read()
        if name.endswith(".md"):
            pages += 1
            faults += broken_links(root, name, text)
        faults += missing_names(root, name, text)
    print("\n".join(faults) or f"{pages} pages: all links lead somewhere")
    if pages < 20:
        sys.exit("too few pages found")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
