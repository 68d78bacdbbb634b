"""Runs blender_test.py in Blender, with the add-on of this tree and the program as it is installed.

Usage: run_test.py CMAKE BUILD_FOLDER [TEST...]; 77: skipped.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
blender = shutil.which("blender")
if blender is None:
    print("skipped: Blender is not installed (scripts/deps.sh blender)")
    sys.exit(77)
if subprocess.run(["/usr/bin/python3", "-c", "import OpenImageIO"], capture_output=True).returncode != 0:
    print("skipped: OpenImageIO for Python is not installed (scripts/deps.sh blender)")
    sys.exit(77)

with tempfile.TemporaryDirectory(prefix="lucerna-blender-") as work:
    addons = pathlib.Path(work, "scripts", "addons")
    addons.mkdir(parents=True)
    shutil.copy(root / "blender" / "lucerna_render.py", addons)
    environment = dict(os.environ, BLENDER_USER_SCRIPTS=str(addons.parent), BLENDER_USER_CONFIG=os.path.join(work, "config"))
    installed = pathlib.Path(work, "installed")
    subprocess.run([sys.argv[1], "--install", sys.argv[2], "--prefix", str(installed)], check=True, stdout=subprocess.DEVNULL)
    data = root.parent / "shared" / "data"
    command = [blender, "-b", "--factory-startup", "-P", str(here / "blender_test.py"), "--", str(installed / "bin" / "lucerna"), str(data), work, *sys.argv[3:]]
    sys.exit(subprocess.run(command, env=environment).returncode)
